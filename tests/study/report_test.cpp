#include "asperity/study/report.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "tests/study/reports.h"

namespace asperity::report_test {
namespace {

using namespace synthetic;

std::string html_of(const RunReport& report) {
  const auto html = run_report_html(report);
  EXPECT_TRUE(html.ok());
  return html.ok() ? *html : std::string();
}

nlohmann::json data_of(const std::string& html) {
  const std::string open = "<script type=\"application/json\" id=\"data\">";
  const std::size_t begin = html.find(open) + open.size();
  return nlohmann::json::parse(html.substr(begin, html.find("</script>", begin) - begin));
}

std::size_t count_of(const std::string& text, const std::string& what) {
  std::size_t count = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++count;
  return count;
}

TEST(RunReport, DataParsesBackToTheNumbers) {
  const RunReport report = run_report("sheet");
  const auto data = data_of(html_of(report));
  EXPECT_EQ(data["title"], "sheet");
  EXPECT_EQ(data["command"], report.origin.command);
  const auto& n = data["laws"][0]["numbers"];
  EXPECT_EQ(n["ticks"], report.metrics.ticks.ticks);
  EXPECT_NEAR(n["force_mean_n"].get<double>(), report.metrics.force.mean, 1e-4 * report.metrics.force.mean);
  EXPECT_NEAR(n["relief_um"].get<double>(), 1e6 * report.metrics.height.amplitude,
              1e-4 * 1e6 * report.metrics.height.amplitude);
  EXPECT_NEAR(n["absorbed_mj"].get<double>(), 1e3 * report.metrics.energy.absorbed,
              1e-4 * 1e3 * report.metrics.energy.absorbed);
  EXPECT_TRUE(n["mean_loop_mj"].is_null());
  // Distance, normal, tangential, magnitude of every tick along the stroke, in mm and N.
  const auto& rows = data["laws"][0]["force_distance"]["rows"];
  ASSERT_GT(rows.size(), 1000u);
  std::size_t row = 0;
  for (std::size_t i = 0; i < report.series.size(); ++i) {
    if (!report.series.stroking[i] || row >= rows.size()) continue;
    ASSERT_NEAR(rows[row][0].get<double>(), 1e3 * report.series.distance[i], 1e-4);
    ASSERT_NEAR(rows[row][1].get<double>(), report.series.normal[i], 1e-5);
    ++row;
  }
  EXPECT_EQ(row, rows.size());
}

TEST(RunReport, AsksNoNetworkForAnything) {
  const std::string html = html_of(run_report("sheet", true));
  EXPECT_EQ(count_of(html, "src=\"http"), 0u);
  EXPECT_EQ(count_of(html, "src=\"//"), 0u);
  EXPECT_EQ(count_of(html, "<link"), 0u);
  EXPECT_EQ(count_of(html, "@import"), 0u);
  EXPECT_EQ(count_of(html, "url("), 0u);
  EXPECT_EQ(count_of(html, "sourceMappingURL"), 0u);
  // The one address in the file is where the plot library's licence comment points to; nothing loads it.
  const std::regex address("https?:[^\\s\"'<>)]*");
  for (auto i = std::sregex_iterator(html.begin(), html.end(), address); i != std::sregex_iterator(); ++i) {
    EXPECT_NE(i->str().find("/LICENSE"), std::string::npos) << i->str();
  }
}

TEST(RunReport, HostileTextsStayText) {
  const std::string hostile =
      "</script><script>alert(1)</script><img src=x onerror=alert(2)>\"'&\xE2\x80\xA8\xE2\x80\xA9";
  RunReport report = run_report(hostile);
  const std::string plain = html_of(run_report("sheet"));
  report.law = hostile;
  report.origin.command = report.origin.machine = report.origin.date = report.origin.program = hostile;
  report.origin.notes = report.origin.warnings = {hostile};
  report.setup = {{hostile, hostile}};
  const std::string html = html_of(report);
  EXPECT_EQ(count_of(html, "<script"), count_of(plain, "<script"));
  EXPECT_EQ(count_of(html, "</script"), count_of(plain, "</script"));
  EXPECT_EQ(count_of(html, "<img"), 0u);
  const auto data = data_of(html);
  EXPECT_EQ(data["title"], hostile);
  EXPECT_EQ(data["setup"][0][1], hostile);
}

TEST(RunReport, TextThatIsNotUtf8IsReadable) {
  const auto data = data_of(html_of(run_report("bad\xFF name")));
  EXPECT_NE(data["title"].get<std::string>().find("name"), std::string::npos);
}

TEST(RunReport, LongRunsAreThinnedAndKeepTheirExtremes) {
  RunReport report = run_report("long");
  // 400,000 ticks of noise-free wave with one spike.
  const std::size_t n = 400000;
  RunSeries& s = report.series;
  s = {};
  for (std::size_t i = 0; i < n; ++i) {
    const double t = 1e-3 * static_cast<double>(i);
    s.time.push_back(t);
    s.distance.push_back(1e-5 * static_cast<double>(i));
    s.normal.push_back(i == 123456 ? 9.75 : 1.0 + 0.3 * std::sin(t));
    for (auto* column : {&s.force, &s.tangential, &s.friction, &s.texture, &s.followed, &s.relief, &s.direction_error,
                         &s.work, &s.stored, &s.follow, &s.update})
      column->push_back(0.1 * std::cos(t));
    s.near_step.push_back(0);
    s.stroking.push_back(1);
  }
  const std::string html = html_of(report);
  EXPECT_LT(html.size(), 5u << 20U);
  const auto data = data_of(html);
  const auto& part = data["laws"][0]["force_distance"];
  EXPECT_EQ(part["ticks"], n);
  EXPECT_LT(part["rows"].size(), 15000u);
  double largest = 0.0;
  for (const auto& row : part["rows"]) largest = std::max(largest, row[1].get<double>());
  EXPECT_NEAR(largest, 9.75, 1e-4);
}

TEST(RunReport, SeriesOfUnequalColumnsIsRefused) {
  RunReport report = run_report("sheet");
  report.series.work.pop_back();
  const auto html = run_report_html(report);
  ASSERT_FALSE(html.ok());
  EXPECT_EQ(html.error().code, ErrorCode::bad_value);
  EXPECT_EQ(html.error().place, "series");
}

TEST(RunReport, SummarySpeaksOfWhatHappened) {
  RunReport report = run_report("sheet");
  const std::string text = summarise(report);
  EXPECT_NE(text.find("followed a relief"), std::string::npos) << text;
  EXPECT_NE(text.find("safety stage changed nothing"), std::string::npos) << text;
  report.metrics.ticks.contact = 0;
  EXPECT_NE(summarise(report).find("Nothing was touched"), std::string::npos);
}

TEST(CompareReport, HoldsEveryLawWithItsVerdict) {
  const CompareReport report = compare_report("laws");
  const auto html = compare_report_html(report);
  ASSERT_TRUE(html.ok());
  const auto data = data_of(*html);
  const std::vector<std::string> names = relief_laws();
  ASSERT_EQ(data["laws"].size(), names.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    EXPECT_EQ(data["laws"][i]["law"], names[i]);
    EXPECT_EQ(data["laws"][i]["verdict"], verdict(report.entries[i].metrics));
  }
  ASSERT_EQ(names[1], "god-object");
  EXPECT_NE(verdict(report.entries[1].metrics).find("renders no height"), std::string::npos);
  EXPECT_LT(html->size(), 5u << 20U);
}

TEST(CompareReport, HoldsFollowErrorsAndDetectionOfAVolume) {
  const CompareReport report = volume_report("a volume");
  const auto html = compare_report_html(report);
  ASSERT_TRUE(html.ok());
  const auto data = data_of(*html);
  ASSERT_EQ(data["laws"].size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    const auto& law = data["laws"][i];
    // 1 mm of 30 mm.
    EXPECT_NEAR(law["numbers"]["follow_global_percent"].get<double>(), 100.0 / 30.0, 0.01);
    EXPECT_GT(law["follow_time"]["rows"].size(), 100u);
    EXPECT_NE(law["verdict"].get<std::string>().find("follow error 3.3 %"), std::string::npos);
  }
  ASSERT_EQ(data["detection"].size(), report.detection.size());
  EXPECT_EQ(data["detection"][0][4], 1.0);
  EXPECT_TRUE(data_of(*compare_report_html(compare_report("laws")))["laws"][0]["follow_time"].is_null());
}

TEST(CompareReport, NothingToCompareIsRefused) {
  const auto html = compare_report_html(CompareReport{});
  ASSERT_FALSE(html.ok());
  EXPECT_EQ(html.error().place, "entries");
}

TEST(WriteReport, WritesThePageAndLeavesNothingBeside) {
  const auto folder =
      std::filesystem::temp_directory_path() /
      ("asperity-report-" + std::to_string(::testing::UnitTest::GetInstance()->random_seed()) + "-write");
  std::filesystem::create_directories(folder);
  const RunReport report = run_report("sheet");
  ASSERT_TRUE(write_run_report(folder / "report.html", report).ok());
  std::ifstream file(folder / "report.html");
  std::stringstream text;
  text << file.rdbuf();
  EXPECT_EQ(text.str(), html_of(report));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder), std::filesystem::directory_iterator()), 1);
  const auto missing = write_run_report(folder / "none" / "report.html", report);
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.error().code, ErrorCode::file_unwritable);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace asperity::report_test
