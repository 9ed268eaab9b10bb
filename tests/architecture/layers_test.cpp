// The modules' order, and the one place that each outside library has.

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "tests/architecture/source_tree.h"

namespace asperity::architecture {
namespace {

const std::vector<std::string> order = {"core",   "geometry", "field", "material", "surface",
                                        "render", "device",   "servo", "io",       "study"};

std::ptrdiff_t place_in_order(const std::string& module) {
  return std::find(order.begin(), order.end(), module) - order.begin();
}

TEST(Layers, EveryModuleHasItsPlaceInTheOrder) {
  for (const SourceFile& file : files_below("asperity/", {".h", ".cpp"})) {
    if (file.path == umbrella) continue;
    EXPECT_LT(place_in_order(module_of(file.path)), static_cast<std::ptrdiff_t>(order.size())) << file.path;
  }
}

TEST(Layers, ModulesIncludeOnlyModulesAboveThem) {
  // render must work without any device, loop or file: what moves the probe comes from outside.
  const std::vector<std::string> not_for_render = {"device", "servo", "io", "study"};
  for (const SourceFile& file : files_below("asperity/", {".h", ".cpp"})) {
    const std::string module = module_of(file.path);
    for (std::size_t i = 0; i < file.lines.size(); ++i) {
      const std::string name = included(file.lines[i]);
      if (name.empty() || name.front() != '"') continue;
      const std::string other = module_of(name.substr(1));
      EXPECT_FALSE(other.empty()) << file.path << ":" << i + 1 << ": includes " << name
                                  << "; modules include \"asperity/MODULE/...\" only";
      EXPECT_LE(place_in_order(other), place_in_order(module))
          << file.path << ":" << i + 1 << ": " << module << " may not include " << name;
      if (module == "render") {
        EXPECT_EQ(std::count(not_for_render.begin(), not_for_render.end(), other), 0) << file.path << ":" << i + 1;
      }
    }
  }
}

// Folders whose headers are their module's own.
const std::vector<std::string> own_folders = {"/detail/", "/render/contact/", "/render/stages/"};

/// Where the own folder begins in a header's path; npos where it is in none.
std::size_t own_folder_in(const std::string& header) {
  std::size_t first = std::string::npos;
  for (const std::string& folder : own_folders) {
    const std::size_t at = header.find(folder);
    if (at != std::string::npos) first = std::min(first, folder == "/detail/" ? at : at + folder.find('/', 1));
  }
  return first;
}

/// What cmake/AsperityInstall.cmake takes along of the headers below asperity/.
bool is_installed(const std::string& header) {
  const std::vector<std::string> left_out = {"/io/vdb/", "/io/vtk/", "/study/nlopt/"};
  return own_folder_in(header) == std::string::npos &&
         std::none_of(left_out.begin(), left_out.end(),
                      [&](const std::string& folder) { return header.find(folder) != std::string::npos; });
}

// Headers in a module's own folders are not installed: an installed one that includes them would not compile.
TEST(Layers, OwnFoldersAreTheModulesOwn) {
  int seen = 0;
  for (const SourceFile& file : files_below("", {".h", ".cpp"})) {
    const bool of_a_module = file.path.compare(0, 9, "asperity/") == 0;
    const bool of_tests = file.path.compare(0, 6, "tests/") == 0;
    for (std::size_t i = 0; i < file.lines.size(); ++i) {
      const std::string name = included(file.lines[i]);
      const std::size_t own = own_folder_in(name);
      if (own == std::string::npos || name.front() != '"') continue;
      ++seen;
      if (of_tests) continue;
      const std::string folder = name.substr(1, own);  // "asperity/MODULE/"
      EXPECT_TRUE(of_a_module && file.path.compare(0, folder.size(), folder) == 0)
          << file.path << ":" << i + 1 << ": " << name << " is another module's own";
      const bool is_public = file.path.ends_with(".h") && is_installed(file.path);
      EXPECT_FALSE(is_public) << file.path << ":" << i + 1 << ": " << name << " is not installed, this header is";
    }
  }
  EXPECT_GT(seen, 40);
}

/// Units, a header and its source, by their path without ending, and which others each includes.
using Includes = std::map<std::string, std::set<std::string>>;

Includes includes_within(const std::string& module) {
  const auto unit = [](const std::string& path) { return path.substr(0, path.rfind('.')); };
  Includes all;
  for (const SourceFile& file : files_below("asperity/" + module + "/", {".h", ".cpp"})) {
    std::set<std::string>& others = all[unit(file.path)];
    for (const std::string& line : file.lines) {
      const std::string name = included(line);
      if (name.empty() || name.front() != '"' || module_of(name.substr(1)) != module) continue;
      if (const std::string other = unit(name.substr(1)); other != unit(file.path)) others.insert(other);
    }
  }
  return all;
}

/// Strongly connected components of more than one unit, each sorted.
std::set<std::vector<std::string>> circles(const Includes& includes) {
  const auto reached_from = [&](const std::string& start) {
    std::set<std::string> reached;
    std::vector<std::string> open{start};
    while (!open.empty()) {
      const auto at = includes.find(open.back());
      open.pop_back();
      if (at == includes.end()) continue;
      for (const std::string& other : at->second) {
        if (reached.insert(other).second) open.push_back(other);
      }
    }
    return reached;
  };
  std::map<std::string, std::set<std::string>> reach;
  for (const auto& [unit, others] : includes) reach[unit] = reached_from(unit);
  std::set<std::vector<std::string>> found;
  for (const auto& [unit, there] : reach) {
    std::vector<std::string> circle{unit};
    for (const std::string& other : there) {
      if (other != unit && reach[other].count(unit) > 0) circle.push_back(other);
    }
    std::sort(circle.begin(), circle.end());
    if (circle.size() > 1) found.insert(circle);
  }
  return found;
}

TEST(Layers, RenderHasNoIncludeCircle) {
  const Includes render = includes_within("render");
  EXPECT_GT(render.size(), 30U);
  for (const std::vector<std::string>& circle : circles(render)) {
    std::string units;
    for (const std::string& unit : circle) units += " " + unit;
    ADD_FAILURE() << "these include one another:" << units;
  }
}

TEST(Layers, AnIncludeCircleIsSeen) {
  const Includes some = {{"a", {"b"}}, {"b", {"c"}}, {"c", {"a", "d"}}, {"d", {"e"}}, {"e", {}}, {"f", {"a"}}};
  EXPECT_EQ(circles(some), (std::set<std::vector<std::string>>{{"a", "b", "c"}}));
}

TEST(Layers, TheUmbrellaIncludesEveryPublicHeaderUpToIo) {
  std::vector<std::string> wanted;
  for (const SourceFile& header : files_below("asperity/", {".h"})) {
    if (header.path == umbrella || module_of(header.path) == "study") continue;
    if (!is_installed(header.path) || says_private(header)) continue;
    wanted.push_back('"' + header.path + '"');
  }
  std::vector<std::string> found;
  const std::vector<SourceFile> headers = files_below(umbrella, {".h"});
  ASSERT_EQ(headers.size(), 1U);
  for (const std::string& line : headers.front().lines) {
    if (const std::string name = included(line); !name.empty()) found.push_back(name);
  }
  std::sort(found.begin(), found.end());
  std::sort(wanted.begin(), wanted.end());
  EXPECT_EQ(found, wanted);
}

TEST(Layers, TheUmbrellaIsForProgramsAlone) {
  for (const char* folder : {"asperity/", "apps/", "bench/"}) {
    for (const SourceFile& file : files_below(folder, {".h", ".cpp"})) {
      for (std::size_t i = 0; i < file.lines.size(); ++i)
        EXPECT_NE(included(file.lines[i]), '"' + std::string(umbrella) + '"') << file.path << ":" << i + 1;
    }
  }
}

TEST(Layers, OutsideLibrariesStayInTheirPlaces) {
  const std::vector<std::pair<std::string, std::vector<std::string>>> places = {{"<Eigen/", {"core"}},
                                                                                {"<nlohmann/", {"io", "study"}},
                                                                                {"<png.h>", {"io"}},
                                                                                {"<OpenEXR/", {"io"}},
                                                                                {"<stb/", {"io"}},
                                                                                {"<tiny_obj_loader.h>", {"io"}},
                                                                                {"<kissfft/", {"study"}},
                                                                                {"<nlopt.h>", {"study"}},
                                                                                {"<CLI/", {}},
                                                                                {"<embree3/", {}}};
  for (const SourceFile& file : files_below("asperity/", {".h", ".cpp"})) {
    for (std::size_t i = 0; i < file.lines.size(); ++i) {
      const std::string name = included(file.lines[i]);
      for (const auto& [start, modules] : places) {
        if (name.compare(0, start.size(), start) != 0) continue;
        EXPECT_NE(std::count(modules.begin(), modules.end(), module_of(file.path)), 0)
            << file.path << ":" << i + 1 << ": " << name << " has its place elsewhere";
      }
    }
  }
}

}  // namespace
}  // namespace asperity::architecture
