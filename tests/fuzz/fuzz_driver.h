#pragma once
// A small in-process fuzzer, for compilers without one of their own. A target is one function with the usual signature,
//
//   extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
//
// that calls std::abort() or throws when what it tests misbehaves, a corpus of small valid inputs, and
//
//   int main(int argc, char** argv) { return asperity::fuzz::run(argc, argv, "mesh", corpus()); }
//
// Options: --seconds N (default 10), --seed S (default 1), or files: each is run once, to repeat a finding. With
// -fsanitize=fuzzer the same function serves libFuzzer (define ASPERITY_FUZZ_WITHOUT_MAIN).
// An input that ends the program (exception, abort, crash) is saved as fuzz-NAME-failure.bin in the current folder.

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "asperity/core/rng.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace asperity::fuzz {

/// What a signal handler can still reach: the input being run and where to save it.
struct Running {
  const char* data = nullptr;
  std::size_t size = 0;
  char path[128] = {};
};
inline Running running;

/// Async-signal-safe: system calls only.
inline void save_running_input() {
  const int descriptor = ::open(running.path, O_WRONLY | O_CREAT | O_TRUNC, 0666);
  if (descriptor < 0) return;
  const ssize_t written = ::write(descriptor, running.data, running.size);
  ::close(descriptor);
  const char* note = written < 0 ? "input could not be saved\n" : "input saved\n";
  if (::write(2, note, std::strlen(note)) < 0) return;
}

inline void on_fatal_signal(int signal_number) {
  save_running_input();
  std::signal(signal_number, SIG_DFL);
  std::raise(signal_number);
}

/// Changes an input in one of the ways that break readers.
class Mutator {
 public:
  Mutator(const std::vector<std::string>& corpus, std::uint64_t seed) : corpus_(corpus), rng_(seed) {}

  std::string next() {
    std::string input = pick();
    const std::uint32_t changes = 1 + rng_.below(4);
    for (std::uint32_t i = 0; i < changes; ++i) change(input);
    if (input.size() > largest) input.resize(largest);
    return input;
  }

 private:
  static constexpr std::size_t largest = std::size_t{1} << 16U;

  std::uint32_t below(std::size_t count) {
    return rng_.below(static_cast<std::uint32_t>(std::max<std::size_t>(count, 1)));
  }
  const std::string& pick() { return corpus_[below(corpus_.size())]; }

  void change(std::string& input) {
    switch (rng_.below(9)) {
      case 0: flip_bit(input); break;
      case 1: input.resize(below(input.size() + 1)); break;
      case 2: splice(input); break;
      case 3: replace_number(input); break;
      case 4: replace_number(input); break;
      case 5: overwrite_word(input); break;
      case 6: input.insert(below(input.size() + 1), 1, static_cast<char>(rng_.below(256))); break;
      case 7: erase(input); break;
      default: repeat(input); break;
    }
  }

  void flip_bit(std::string& input) {
    if (input.empty()) return;
    char& c = input[below(input.size())];
    c = static_cast<char>(static_cast<unsigned char>(c) ^ (1U << rng_.below(8)));
  }

  void splice(std::string& input) {
    const std::string& other = pick();
    const std::size_t from = below(other.size() + 1);
    input = input.substr(0, below(input.size() + 1)) + other.substr(from);
  }

  void erase(std::string& input) {
    const std::size_t from = below(input.size() + 1);
    input.erase(from, below(16));
  }

  void repeat(std::string& input) {
    const std::size_t from = below(input.size() + 1);
    const std::string part = input.substr(from, below(64));
    const std::uint32_t times = rng_.below(32);
    for (std::uint32_t i = 0; i < times && input.size() < largest; ++i) input.insert(from, part);
  }

  /// Replaces a run of digits by a number at an edge of some range.
  void replace_number(std::string& input) {
    static const std::vector<std::string> numbers = {"0",
                                                     "-1",
                                                     "1",
                                                     "-0",
                                                     "255",
                                                     "256",
                                                     "1024",
                                                     "65536",
                                                     "2147483647",
                                                     "2147483648",
                                                     "4294967295",
                                                     "4294967296",
                                                     "-2147483648",
                                                     "9223372036854775807",
                                                     "18446744073709551616",
                                                     "99999999999999999999",
                                                     "nan",
                                                     "inf",
                                                     "-inf",
                                                     "1e308",
                                                     "1e-320",
                                                     "1e999",
                                                     "-1e999",
                                                     "0x10",
                                                     "1e",
                                                     ".",
                                                     "+-1",
                                                     "1.5",
                                                     "\"1\"",
                                                     "null"};
    const auto digit = [](char c) { return c >= '0' && c <= '9'; };
    const std::size_t start = below(input.size() + 1);
    auto begin = std::find_if(input.begin() + static_cast<std::ptrdiff_t>(start), input.end(), digit);
    const auto end = std::find_if_not(begin, input.end(), digit);
    input.replace(begin, end, numbers[below(numbers.size())]);
  }

  /// Overwrites four bytes by a pattern that is an extreme number in one of the binary encodings.
  void overwrite_word(std::string& input) {
    static constexpr std::uint32_t patterns[] = {0,          1,          0xFFFFFFFFU, 0x7FFFFFFFU, 0x80000000U,
                                                 0x7F800000, 0x7FC00000, 0x0000FFFFU, 0xFF000000U, 0x01000000U};
    if (input.size() < 4) return;
    const std::uint32_t pattern = patterns[rng_.below(10)];
    std::memcpy(input.data() + below(input.size() - 3), &pattern, sizeof pattern);
  }

  const std::vector<std::string>& corpus_;
  Rng rng_;
};

/// Runs one input; false, with the input saved, if an exception came out.
inline bool run_one(const std::string& input) {
  running.data = input.data();
  running.size = input.size();
  try {
    LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(input.data()), input.size());
    return true;
  } catch (const std::exception& problem) {
    std::fprintf(stderr, "exception: %s\n", problem.what());
  } catch (...) {
    std::fprintf(stderr, "exception of unknown type\n");
  }
  save_running_input();
  return false;
}

inline int run_files(const std::vector<std::string>& paths) {
  for (const std::string& path : paths) {
    std::ifstream stream(path, std::ios::binary);
    if (!stream) {
      std::fprintf(stderr, "%s: cannot be read\n", path.c_str());
      return 2;
    }
    const std::string input{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
    if (!run_one(input)) return 1;
  }
  return 0;
}

/// Runs the corpus itself, then mutations of it until the time is up. 0: nothing found, 1: an input failed, 2: bad
/// usage.
inline int run(int argc, char** argv, const char* name, const std::vector<std::string>& corpus) {
  double seconds = 10.0;
  std::uint64_t seed = 1;
  std::vector<std::string> files;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    const bool has_value = i + 1 < argc;
    if (argument == "--seconds" && has_value) {
      seconds = std::strtod(argv[++i], nullptr);
    } else if (argument == "--seed" && has_value) {
      seed = std::strtoull(argv[++i], nullptr, 10);
    } else if (argument.starts_with("--")) {
      std::fprintf(stderr, "usage: %s [--seconds N] [--seed S] [FILE...]\n", argv[0]);
      return 2;
    } else {
      files.push_back(argument);
    }
  }
  std::snprintf(running.path, sizeof running.path, "fuzz-%s-failure.bin", name);
  for (const int signal_number : {SIGSEGV, SIGABRT, SIGFPE, SIGBUS, SIGILL})
    std::signal(signal_number, on_fatal_signal);
  if (!files.empty()) return run_files(files);
  for (const std::string& input : corpus) {
    if (!run_one(input)) return 1;
  }
  Mutator mutator(corpus, seed);
  const auto begin = std::chrono::steady_clock::now();
  std::uint64_t runs = 0;
  while (std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() < seconds) {
    for (int i = 0; i < 64; ++i, ++runs) {
      if (!run_one(mutator.next())) return 1;
    }
  }
  std::printf("fuzz %s: %llu inputs, nothing found (seed %llu)\n", name, static_cast<unsigned long long>(runs),
              static_cast<unsigned long long>(seed));
  return 0;
}

}  // namespace asperity::fuzz
