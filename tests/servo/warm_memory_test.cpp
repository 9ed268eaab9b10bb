#include "asperity/servo/warm_memory.h"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <memory>
#include <new>
#include <string_view>
#include <vector>

namespace asperity::warm_memory_test {
namespace {

const std::size_t page_size = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));

/// Private memory of its own, as a large vector has it; nothing of it is written yet.
class Block {
 public:
  explicit Block(std::size_t pages)
      : bytes_(pages * page_size),
        data_(static_cast<char*>(::mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0))) {
    if (data_ == MAP_FAILED) throw std::bad_alloc();
    ::madvise(data_, bytes_, MADV_NOHUGEPAGE);
  }
  Block(const Block&) = delete;
  Block& operator=(const Block&) = delete;
  ~Block() { ::munmap(data_, bytes_); }

  void write(std::size_t page) { data_[page * page_size] = 1; }
  void rights(int value) { ::mprotect(data_, bytes_, value); }

  std::size_t pages_present() const {
    std::vector<unsigned char> present(bytes_ / page_size);
    if (::mincore(data_, bytes_, present.data()) != 0) return 0;
    return static_cast<std::size_t>(std::count_if(present.begin(), present.end(), [](auto p) { return (p & 1) != 0; }));
  }

 private:
  std::size_t bytes_;
  char* data_;
};

TEST(WarmMemory, ReadsEveryPageThatWasWritten) {
#if defined(ASPERITY_SANITIZED)
  GTEST_SKIP() << "sanitizers keep pages of their own beside each that is written";
#endif
  const std::uint64_t before = warm_memory().pages;
  ASSERT_GT(before, 0U);
  constexpr std::size_t written = 5000;  // several calls, the last of them not full
  Block block(2 * written);
  for (std::size_t i = 0; i < written; ++i) block.write(2 * i);
  const WarmedMemory after = warm_memory();
  // Beside the block only bookkeeping of the run itself comes and goes.
  EXPECT_NEAR(static_cast<double>(after.pages - before), written, 100);
  EXPECT_EQ(after.bytes, after.pages * page_size);
}

TEST(WarmMemory, AllocatesNothingForWhatWasOnlyReserved) {
  Block block(20000);
  block.write(7);
  warm_memory();
  EXPECT_EQ(block.pages_present(), 1U);
}

TEST(WarmMemory, LeavesMemoryThatMayNotBeRead) {
  Block block(3000);
  for (std::size_t i = 0; i < 3000; ++i) block.write(i);
  const std::uint64_t readable = warm_memory().pages;
  block.rights(PROT_NONE);
  EXPECT_NEAR(static_cast<double>(readable - warm_memory().pages), 3000, 100);
}

TEST(WarmMemory, PassesOverWhatItsProgressReturns) {
  auto block = std::make_unique<Block>(60000);  // more than two strides
  for (std::size_t i = 0; i < 60000; ++i) block->write(i);
  const std::uint64_t whole = warm_memory().pages;
  const std::uint64_t rest = warm_memory([&](std::string_view, double) { block.reset(); }).pages;
  EXPECT_LT(rest, whole - 30000);
}

TEST(WarmMemory, TellsHowFarItIs) {
  Block block(40000);  // more than one stride
  std::vector<double> told;
  warm_memory([&](std::string_view what, double fraction) {
    EXPECT_EQ(what, "warming memory");
    told.push_back(fraction);
  });
  ASSERT_GT(told.size(), 2U);
  EXPECT_TRUE(std::is_sorted(told.begin(), told.end()));
  EXPECT_NEAR(told.back(), 1.0, 1e-9);
}

}  // namespace
}  // namespace asperity::warm_memory_test
