#include "asperity/core/parallel_for.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <mutex>
#include <numeric>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace asperity::parallel_for_test {
namespace {

TEST(ParallelFor, VisitsEveryItemOnceForAnyCountGrainAndNumberOfThreads) {
  for (const std::size_t count : {0U, 1U, 2U, 7U, 64U, 1000U}) {
    for (const std::size_t grain : {0U, 1U, 3U, 64U, 5000U}) {
      for (const unsigned threads : {0U, 1U, 2U, 3U, 17U}) {
        std::vector<std::atomic<int>> visits(count);
        parallel_for(count, {.grain = grain, .threads = threads}, [&](std::size_t i) { ++visits[i]; });
        for (std::size_t i = 0; i < count; ++i)
          ASSERT_EQ(visits[i], 1) << i << " of " << count << ", grain " << grain << ", " << threads << " threads";
      }
    }
  }
}

TEST(ParallelFor, ResultsDoNotDependOnTheNumberOfThreads) {
  const auto made_by = [](unsigned threads) {
    std::vector<double> out(5000);
    parallel_for(out.size(), {.grain = 16, .threads = threads},
                 [&](std::size_t i) { out[i] = std::sin(1.0 / (1.0 + static_cast<double>(i))); });
    return out;
  };
  const std::vector<double> alone = made_by(1);
  for (const unsigned threads : {2U, 3U, 8U, 0U}) EXPECT_EQ(made_by(threads), alone) << threads;
}

TEST(ParallelFor, WorkersAreBelowTheirNumberAndNeverAtTwoBodiesAtATime) {
  const ParallelSettings settings{.grain = 4, .threads = 5};
  const unsigned workers = parallel_workers(400, settings);
  EXPECT_EQ(workers, 5U);
  std::vector<std::atomic<int>> busy(workers);
  std::atomic<int> clashes{0};
  std::atomic<int> strays{0};
  parallel_for(400, settings, [&](std::size_t, unsigned worker) {
    if (worker >= workers) {
      ++strays;
      return;
    }
    if (busy[worker]++ != 0) ++clashes;
    std::this_thread::yield();
    --busy[worker];
  });
  EXPECT_EQ(clashes, 0);
  EXPECT_EQ(strays, 0);
}

TEST(ParallelFor, NoMoreThreadsThanShares) {
  EXPECT_EQ(parallel_workers(0, {}), 1U);
  EXPECT_EQ(parallel_workers(16, {.grain = 16, .threads = 8}), 1U);
  EXPECT_EQ(parallel_workers(17, {.grain = 16, .threads = 8}), 2U);
  EXPECT_EQ(parallel_workers(1000, {.threads = 8}), 8U);
  EXPECT_EQ(parallel_workers(100000, {}), std::max(1U, std::thread::hardware_concurrency()));
}

TEST(ParallelFor, OneShareStaysInTheCallersThread) {
  const std::thread::id caller = std::this_thread::get_id();
  std::set<std::thread::id> seen;
  parallel_for(8, {.grain = 8, .threads = 4}, [&](std::size_t) { seen.insert(std::this_thread::get_id()); });
  EXPECT_EQ(seen, std::set<std::thread::id>{caller});
}

TEST(ParallelFor, LoopsWithinLoopsAreDoneInTheirOwnThread) {
  std::vector<std::atomic<int>> visits(40 * 50);
  std::atomic<int> elsewhere{0};
  parallel_for(40, {.threads = 4}, [&](std::size_t i) {
    const std::thread::id mine = std::this_thread::get_id();
    if (parallel_workers(50, {.threads = 4}) != 1) ++elsewhere;
    parallel_for(50, {.threads = 4}, [&](std::size_t k, unsigned worker) {
      ++visits[50 * i + k];
      if (worker != 0 || std::this_thread::get_id() != mine) ++elsewhere;
    });
  });
  EXPECT_EQ(elsewhere, 0);
  for (const std::atomic<int>& visit : visits) ASSERT_EQ(visit, 1);
  EXPECT_EQ(parallel_workers(50, {.threads = 4}), 4U) << "the loop is over";
}

TEST(ParallelFor, ALoopWithinOneThatIsNotSharedMayBe) {
  parallel_for(3, {.threads = 1}, [](std::size_t) { EXPECT_EQ(parallel_workers(50, {.threads = 4}), 4U); });
}

TEST(ParallelFor, ThrowsWhatAPlainLoopWouldHaveThrownFirst) {
  for (int round = 0; round < 50; ++round) {
    for (const unsigned threads : {1U, 2U, 6U}) {
      std::atomic<int> running{0};
      std::string caught;
      try {
        parallel_for(500, {.grain = 3, .threads = threads}, [&](std::size_t i) {
          ++running;
          if (i == 100 || i == 101 || i == 110 || i == 400) {
            --running;
            throw std::runtime_error(std::to_string(i));
          }
          if (i < 110) std::this_thread::yield();
          --running;
        });
      } catch (const std::runtime_error& error) {
        caught = error.what();
      }
      EXPECT_EQ(caught, "100") << threads << " threads";
      EXPECT_EQ(running, 0) << "all threads are waited for";
    }
  }
}

TEST(ParallelFor, NoSharesAreBegunAfterAnException) {
  std::atomic<int> visits{0};
  EXPECT_THROW(parallel_for(1000000, {.grain = 10, .threads = 1},
                            [&](std::size_t i) {
                              ++visits;
                              if (i == 5) throw std::runtime_error("stop");
                            }),
               std::runtime_error);
  EXPECT_EQ(visits, 6);
}

TEST(ParallelFor, TheCallerIsToldHowFarItIs) {
  const std::thread::id caller = std::this_thread::get_id();
  std::vector<double> told;
  bool elsewhere = false;
  const Progress progress = [&](std::string_view what, double fraction) {
    EXPECT_EQ(what, "counting");
    elsewhere = elsewhere || std::this_thread::get_id() != caller;
    told.push_back(fraction);
  };
  for (const unsigned threads : {1U, 4U}) {
    told.clear();
    parallel_for(100,
                 {.grain = 10, .threads = threads, .progress = &progress, .what = "counting", .from = 0.5, .to = 0.75},
                 [](std::size_t) { std::this_thread::yield(); });
    for (std::size_t i = 0; i < told.size(); ++i) {
      EXPECT_GE(told[i], i == 0 ? 0.5 : told[i - 1]);
      EXPECT_LT(told[i], 0.75);
    }
    if (threads == 1) {
      ASSERT_EQ(told.size(), 10U);
      EXPECT_DOUBLE_EQ(told[3], 0.575);
    }
  }
  EXPECT_FALSE(elsewhere);
}

TEST(ParallelFor, NobodyNeedLookOn) {
  const Progress nobody;
  std::atomic<int> visits{0};
  parallel_for(10, {.progress = &nobody}, [&](std::size_t) { ++visits; });
  EXPECT_EQ(visits, 10);
}

TEST(ParallelFor, WhatProgressThrowsGoesToTheCaller) {
  const Progress impatient = [](std::string_view, double fraction) {
    if (fraction >= 0.5) throw std::runtime_error("enough");
  };
  EXPECT_THROW(parallel_for(100, {.threads = 1, .progress = &impatient}, [](std::size_t) {}), std::runtime_error);
}

}  // namespace
}  // namespace asperity::parallel_for_test
