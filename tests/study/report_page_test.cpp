// Opens report pages in a browser without a window: scripts run, plots draw, nothing fails.

#include <gtest/gtest.h>

#include <unistd.h>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>

#include "tests/study/reports.h"

namespace asperity::report_page_test {
namespace {

using namespace synthetic;

constexpr const char* browser = "/usr/bin/chromium";

std::size_t count_of(const std::string& text, const std::string& what) {
  std::size_t count = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++count;
  return count;
}

class ReportPage : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(browser))
      GTEST_SKIP() << "no " << browser << ": pages are not opened (Debian package chromium)";
    folder_ = std::filesystem::temp_directory_path() / ("asperity-page-" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override {
    if (!folder_.empty()) std::filesystem::remove_all(folder_);
  }

  /// The page's elements after its scripts have run.
  std::string opened(const std::filesystem::path& file) const {
    const std::string command = std::string("timeout 90 ") + browser +
                                " --headless --no-sandbox --disable-gpu --virtual-time-budget=4000 --user-data-dir='" +
                                (folder_ / "profile").string() + "' --dump-dom 'file://" + file.string() +
                                "' 2>/dev/null";
    const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
    std::string text;
    std::array<char, 65536> buffer;
    while (pipe) {
      const std::size_t n = fread(buffer.data(), 1, buffer.size(), pipe.get());
      if (n == 0) break;
      text.append(buffer.data(), n);
    }
    return text;
  }

  static void expect_drawn(const std::string& dom, std::size_t plots) {
    ASSERT_FALSE(dom.empty());
    const std::size_t body = dom.find("<body");
    ASSERT_NE(body, std::string::npos);
    const std::string tag = dom.substr(body, dom.find('>', body) - body);
    EXPECT_NE(tag.find("data-ready=\"true\""), std::string::npos) << tag;
    EXPECT_EQ(tag.find("data-error"), std::string::npos) << tag;
    const std::string drawn = dom.substr(body);
    EXPECT_EQ(count_of(drawn, "<div class=\"plot"), plots);
    // dygraphs lays two canvases over each other: one for lines, one for what follows the pointer.
    EXPECT_EQ(count_of(drawn, "<canvas"), 2 * plots);
  }

  std::filesystem::path folder_;
};

TEST_F(ReportPage, RunPageDrawsEveryPlot) {
  const auto file = folder_ / "run.html";
  ASSERT_TRUE(write_run_report(file, run_report("a sheet", true)).ok());
  const std::string dom = opened(file);
  expect_drawn(dom, 7);
  EXPECT_NE(dom.find("<h1>a sheet</h1>"), std::string::npos);
  EXPECT_NE(dom.find("asperity run sheet --seed 1"), std::string::npos);
}

TEST_F(ReportPage, ComparePageDrawsEveryPlot) {
  const auto file = folder_ / "compare.html";
  ASSERT_TRUE(write_compare_report(file, compare_report("laws")).ok());
  const std::string dom = opened(file);
  expect_drawn(dom, 7);
  EXPECT_NE(dom.find("height-field-literal"), std::string::npos);
}

TEST_F(ReportPage, PagesOfVolumesDrawTheFollowErrorAndTheDetection) {
  const CompareReport compared = volume_report("a volume");
  const auto file = folder_ / "volumes.html";
  ASSERT_TRUE(write_compare_report(file, compared).ok());
  const std::string dom = opened(file);
  expect_drawn(dom, 9);
  EXPECT_NE(dom.find("Follow error over time"), std::string::npos);
  EXPECT_NE(dom.find("Detected over speed"), std::string::npos);

  RunReport report = run_report("a volume");
  report.series = compared.entries[1].series;
  report.metrics = compared.entries[1].metrics;
  ASSERT_TRUE(write_run_report(file, report).ok());
  expect_drawn(opened(file), 8);
}

TEST_F(ReportPage, HostileNamesRunNoScript) {
  const std::string hostile =
      "</script><script>document.body.dataset.error='ran'</script><img src=x "
      "onerror=\"document.body.dataset.error='ran'\">";
  RunReport report = run_report(hostile);
  report.law = hostile;
  report.origin.notes = report.origin.warnings = {hostile};
  report.setup = {{hostile, hostile}};
  const auto file = folder_ / "hostile.html";
  ASSERT_TRUE(write_run_report(file, report).ok());
  expect_drawn(opened(file), 7);
}

TEST_F(ReportPage, RunWithoutContactStillOpens) {
  RunReport report = run_report("nothing touched");
  report.series = RunSeries{};
  report.metrics = RunMetrics{};
  const auto file = folder_ / "empty.html";
  ASSERT_TRUE(write_run_report(file, report).ok());
  expect_drawn(opened(file), 0);
}

}  // namespace
}  // namespace asperity::report_page_test
