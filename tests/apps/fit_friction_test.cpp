// asperity fit-friction by the real program.

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>

namespace asperity::fit_friction_test {
namespace {

namespace fs = std::filesystem;

class FitFriction : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("asperity-fit-friction-" + std::to_string(::getpid()) + "-" +
                                           ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::create_directories(folder_);
    // As a slider of 20 g would: the slope of sticking is stiffness times speed over load.
    write("slip_k168Nm_v2000.csv", sawtooth(168.0 * 2e-3 / 0.2, 0.08));
    write("slip_k400Nm_v2000.csv", sawtooth(400.0 * 2e-3 / 0.2, 0.08));
  }
  void TearDown() override { fs::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }
  [[nodiscard]] static std::string sawtooth(double slope, double drop) {
    std::string text = "t_s,friction_over_load\n";
    double friction = 0.3;
    for (int i = 0; i < 3000; ++i) {
      text += std::to_string(5e-4 * i) + "," + std::to_string(friction) + "\n";
      friction = friction >= 0.3 + drop ? 0.3 : friction + slope * 5e-4;
    }
    return text;
  }
  [[nodiscard]] std::string read(const std::string& name) const {
    std::ifstream stream(folder_ / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }
  [[nodiscard]] int run(const std::string& arguments) const {
    const std::string line = "cd '" + folder_.string() + "' && '" ASPERITY_PROGRAM "' fit-friction " + arguments +
                             " >.out 2>.err </dev/null";
    const int status = std::system(line.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  [[nodiscard]] bool without_library() const {
    return run("slip_k168Nm_v2000.csv --laws viscous --evaluations 1") != 0 &&
           read(".err").find("NLopt") != std::string::npos;
  }
  void refused(const std::string& arguments, const std::string& part) const {
    EXPECT_EQ(run(arguments), 2) << arguments;
    const std::string message = read(".err");
    EXPECT_NE(message.find(part), std::string::npos) << arguments << ": " << message;
    EXPECT_EQ(message.rfind("asperity: ", 0), 0U) << message;
    EXPECT_EQ(std::count(message.begin(), message.end(), '\n'), 1) << message;
  }

  fs::path folder_;
};

TEST_F(FitFriction, WritesTableNumbersAndPage) {
  if (without_library()) GTEST_SKIP() << "the program was built without NLopt";
  const std::string arguments = ". --laws implicit-coulomb,viscous --fit k168Nm --evaluations 12 --out o";
  ASSERT_EQ(run(arguments), 0) << read(".err");
  const std::string table = read(".out");
  for (const char* part : {"k168Nm_v2000", "fitted", "k400Nm_v2000", "predicted", "period (s)", "no stick-slip", "mass",
                           "static_friction", "o/report.html"})
    EXPECT_NE(table.find(part), std::string::npos) << part << "\n" << table;
  const auto numbers = nlohmann::json::parse(read("o/fit-friction.json"));
  const auto& law = numbers["laws"][0];
  EXPECT_EQ(law["material"]["friction"]["law"], "implicit-coulomb");
  EXPECT_GT(law["material"]["friction"]["stiffness"].get<double>(), 0.0);
  EXPECT_GE(law["material"]["static_friction"].get<double>(), law["material"]["dynamic_friction"].get<double>());
  EXPECT_NEAR(law["load_n"].get<double>(), 9.81 * law["mass_kg"].get<double>(), 1e-9);
  EXPECT_EQ(law["traces"][0]["use"], "fitted");
  EXPECT_EQ(law["traces"][1]["use"], "predicted");
  EXPECT_NE(read("o/report.html").find("dygraph"), std::string::npos);
  ASSERT_EQ(run(arguments + " --json --no-report"), 0) << read(".err");
  EXPECT_EQ(nlohmann::json::parse(read(".out"))["laws"], numbers["laws"]) << "another run, another answer";
}

TEST_F(FitFriction, RefusesOneByOne) {
  refused("missing.csv", "no such file");
  fs::create_directories(folder_ / "empty");
  refused("empty", "no CSV files");
  write("text_k1Nm_v1.csv", "hello\nworld\n");
  refused("text_k1Nm_v1.csv", "no column t_s");
  write("nan_k1Nm_v1.csv", "t_s,friction_over_load\n0,1\n1,nan\n");
  refused("nan_k1Nm_v1.csv", "line 3");
  write("back_k1Nm_v1.csv", "t_s,friction_over_load\n0,1\n0,1\n");
  refused("back_k1Nm_v1.csv", "does not increase");
  write("few_k1Nm_v1.csv", "t_s,friction_over_load\n0,1\n1,1\n");
  refused("few_k1Nm_v1.csv", "2 samples");
  write("unnamed.csv", sawtooth(1.0, 0.1));
  refused("unnamed.csv", "--stiffness");
  refused("unnamed.csv --stiffness 168N/m", "--speed");
  refused("unnamed.csv --stiffness 168N/m --speed -1mm/s", "--speed");
  refused("unnamed.csv --stiffness soft --speed 1mm/s", "--stiffness");
  const std::string both = "slip_k168Nm_v2000.csv slip_k400Nm_v2000.csv ";
  refused(both + "./slip_k168Nm_v2000.csv", "named twice");
  refused(both + "--laws karnop", "karnopp");
  refused(both + "--fit k999", "--fit");
  refused(both + "--fit v2000", "2 files");
  refused(both + "--fit k168 --predict k168", "--predict");
  refused(both + "--predict k168,k400", "no trace to fit");
  refused(both + "--mass 0g", "--mass");
  refused(both + "--load heavy", "--load");
  refused(both + "--evaluations 0", "--evaluations");
  refused("", "files");
  EXPECT_FALSE(fs::exists(folder_ / "out"));
}

}  // namespace
}  // namespace asperity::fit_friction_test
