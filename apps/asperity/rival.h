#pragma once
// What a name of `compare --laws` stands for: "implicit/proxy+karnopp+texture-literal".

#include <string>
#include <vector>

#include "asperity/io/experiment.h"

namespace asperity::program {

/// A law, what the meshes of the scene are felt through, and how friction and texture are felt. What the name does not
/// say stays as the scene has it.
struct Rival {
  std::string name;
  std::string kind;  ///< "mesh", "relief" or "implicit"
  std::string law;   ///< empty: the scene's own
  std::vector<std::string> fine;
};

/// What may stand behind a law, each after a "+": a friction law, also with "-literal"; "no-friction", "texture",
/// "texture-literal", "no-texture", "lay", "lay-literal"; "unblended" for a closed relief as it was before,
/// "neighbours" for the literal mesostructure law with a test of all prisms around. [any]
const std::vector<std::string>& fine_words();
/// Errors: bad_value, naming the word and what is accepted. [main]
Result<Rival> parse_rival(const std::string& name);
/// The scene felt as the rival says; by its own law, with its options, where that is the one. Errors: as Scene::build;
/// also where nothing of the scene has the texture or lay that is named. [main]
Result<Experiment> felt_by(const Experiment& experiment, const Rival& rival);
/// What is worth comparing on a scene. [main]
std::vector<std::string> default_rivals(const Scene& scene);
/// Of them those that the scene can be felt by; at least its own law. [main]
std::vector<std::string> suitable_rivals(const Experiment& experiment);

}  // namespace asperity::program
