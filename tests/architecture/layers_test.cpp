// The modules' order, and the one place that each outside library has.

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

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

/// What cmake/AsperityInstall.cmake takes along of the headers below asperity/.
bool is_installed(const std::string& header) {
  const std::vector<std::string> left_out = {"/detail/", "/io/vdb/", "/io/vtk/", "/study/nlopt/"};
  return std::none_of(left_out.begin(), left_out.end(),
                      [&](const std::string& folder) { return header.find(folder) != std::string::npos; });
}

// Headers in detail/ are not installed: an installed one that includes them would not compile.
TEST(Layers, DetailIsTheModulesOwn) {
  int seen = 0;
  for (const SourceFile& file : files_below("", {".h", ".cpp"})) {
    const bool of_a_module = file.path.compare(0, 9, "asperity/") == 0;
    const bool of_tests = file.path.compare(0, 6, "tests/") == 0;
    for (std::size_t i = 0; i < file.lines.size(); ++i) {
      const std::string name = included(file.lines[i]);
      const std::size_t detail = name.find("/detail/");
      if (detail == std::string::npos || name.front() != '"') continue;
      ++seen;
      if (of_tests) continue;
      const std::string folder = name.substr(1, detail);  // "asperity/MODULE/"
      EXPECT_TRUE(of_a_module && file.path.compare(0, folder.size(), folder) == 0)
          << file.path << ":" << i + 1 << ": " << name << " is another module's own";
      const bool is_public = file.path.ends_with(".h") && is_installed(file.path);
      EXPECT_FALSE(is_public) << file.path << ":" << i + 1 << ": " << name << " is not installed, this header is";
    }
  }
  EXPECT_GT(seen, 40);
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
