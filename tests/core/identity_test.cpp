#include "asperity/core/identity.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <thread>
#include <vector>

namespace asperity::identity_test {
namespace {

TEST(Identity, IsNeverGivenTwiceAndNeverZero) {
  constexpr std::size_t each = 20000;
  std::vector<std::vector<std::uint64_t>> taken(4, std::vector<std::uint64_t>(each));
  std::vector<std::thread> threads;
  for (std::vector<std::uint64_t>& mine : taken)
    threads.emplace_back([&mine] { std::generate(mine.begin(), mine.end(), next_identity); });
  for (std::thread& thread : threads) thread.join();
  std::vector<std::uint64_t> all;
  for (const std::vector<std::uint64_t>& mine : taken) all.insert(all.end(), mine.begin(), mine.end());
  std::sort(all.begin(), all.end());
  EXPECT_EQ(std::adjacent_find(all.begin(), all.end()), all.end());
  EXPECT_NE(all.front(), 0U);
}

}  // namespace
}  // namespace asperity::identity_test
