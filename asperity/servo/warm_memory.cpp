#include "asperity/servo/warm_memory.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

namespace asperity {
namespace {

// The presence of so many pages is asked at once.
constexpr std::size_t pages_per_call = 1024;

struct Mapping {
  std::uintptr_t begin = 0;
  std::uintptr_t end = 0;
};

struct Descriptor {
  explicit Descriptor(int number) : number(number) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (number >= 0) ::close(number);
  }
  int number;
};

// What a tick may read: private data, and the code and constants of programs and libraries. Shared memory belongs to
// a device's driver or another program: reading it may mean something there.
bool warmed(const std::string& rights, const std::string& name) {
  return rights.size() == 4 && rights[0] == 'r' && rights[3] == 'p' && !name.starts_with("[v") &&
         !name.starts_with("/dev/");
}

// Reserves larger than the machine's memory hold an allocator's or a sanitizer's bookkeeping.
std::vector<Mapping> mappings(std::uintptr_t largest) {
  std::ifstream stream("/proc/self/maps");
  std::vector<Mapping> found;
  for (std::string line; std::getline(stream, line);) {
    std::array<char, 8> rights{};
    Mapping mapping;
    int name = 0;
    if (std::sscanf(line.c_str(), "%lx-%lx %7s %*s %*s %*s %n", &mapping.begin, &mapping.end, rights.data(), &name) < 3)
      continue;
    if (mapping.end - mapping.begin <= largest &&
        warmed(rights.data(), line.substr(std::min(static_cast<std::size_t>(name), line.size())))) {
      found.push_back(mapping);
    }
  }
  return found;
}

// Loads of this thread itself: those that the kernel makes for it leave its translations as they were. The presence of
// a block's pages is asked just before they are read, as a progress function may have returned some.
class PageReader {
 public:
  PageReader(std::uintptr_t page_size, int presence) : size_(page_size), presence_(presence) {}

  std::uint64_t read(const Mapping& mapping) {
    std::uint64_t pages = 0;
    for (std::uintptr_t at = mapping.begin; at < mapping.end; at += pages_per_call * size_) {
      pages += read_block(at, std::min<std::size_t>(pages_per_call, (mapping.end - at) / size_));
    }
    return pages;
  }

 private:
  // A page of code or of the heap is read wherever its first byte lies, in use or not: nothing for a sanitizer.
  [[gnu::no_sanitize("address", "thread")]] std::uint64_t read_block(std::uintptr_t begin, std::size_t count) {
    const auto entry = static_cast<off_t>(begin / size_ * sizeof(std::uint64_t));
    const std::size_t wanted = count * sizeof(std::uint64_t);
    const ssize_t got = ::pread(presence_, entries_.data(), wanted, entry);
    if (got < 0 || static_cast<std::size_t>(got) != wanted) return 0;
    std::uint64_t pages = 0;
    for (std::size_t i = 0; i < count; ++i) {
      constexpr std::uint64_t present = std::uint64_t{1} << 63;
      if ((entries_[i] & present) == 0) continue;
      // NOLINTNEXTLINE(performance-no-int-to-ptr): addresses come from the system as numbers
      static_cast<void>(*reinterpret_cast<const volatile unsigned char*>(begin + i * size_));
      ++pages;
    }
    return pages;
  }

  std::uintptr_t size_;
  int presence_;
  std::array<std::uint64_t, pages_per_call> entries_{};
};

}  // namespace

WarmedMemory warm_memory(const Progress& progress) {
  WarmedMemory warm;
  const Descriptor presence(::open("/proc/self/pagemap", O_RDONLY | O_CLOEXEC));
  if (presence.number < 0) return warm;
  const auto page_size = static_cast<std::uintptr_t>(::sysconf(_SC_PAGESIZE));
  const std::vector<Mapping> found = mappings(static_cast<std::uintptr_t>(::sysconf(_SC_PHYS_PAGES)) * page_size);
  double whole = 0.0;
  for (const Mapping& mapping : found) whole += static_cast<double>(mapping.end - mapping.begin);
  double done = 0.0;
  PageReader reader(page_size, presence.number);
  for (const Mapping& mapping : found) {
    constexpr std::uintptr_t stride = std::uintptr_t{64} << 20;
    for (std::uintptr_t at = mapping.begin; at < mapping.end;) {
      const Mapping part{at, at + std::min(stride, mapping.end - at)};
      warm.pages += reader.read(part);
      done += static_cast<double>(part.end - part.begin);
      if (progress) progress("warming memory", done / whole);
      at = part.end;
    }
  }
  warm.bytes = warm.pages * page_size;
  return warm;
}

}  // namespace asperity
