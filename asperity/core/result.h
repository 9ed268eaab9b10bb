#pragma once
// Loading and authoring answer a Result: the value, or an Error with a named cause, the file and the place in it.

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "asperity/core/names.h"

namespace asperity {

/// Named cause of a failure.
enum class ErrorCode {
  file_missing,      ///< no such file, or not readable
  file_empty,        ///< nothing in it
  file_truncated,    ///< ends before what its header or syntax promises
  file_malformed,    ///< not the format it claims to be
  file_unsupported,  ///< a format, or a variant of one, that is not read
  file_unwritable,   ///< cannot be created or written
  bad_key,           ///< a key nobody reads
  bad_type,          ///< right key, wrong JSON type
  bad_value,         ///< out of range, not finite, unknown name
  bad_mesh,          ///< geometry that cannot be touched
  bad_map,           ///< an image that cannot be a height or normal map
  unsupported_pair,  ///< this law cannot be used on this surface
  too_large,         ///< would exceed a stated memory or size bound
  mismatch,          ///< two inputs do not belong together (trace and scene, map sizes)
};
/// As in messages and `--json`.
template <>
struct Names<ErrorCode> {
  static constexpr auto table = std::to_array<Named<ErrorCode>>({{ErrorCode::file_missing, "file_missing"},
                                                                 {ErrorCode::file_empty, "file_empty"},
                                                                 {ErrorCode::file_truncated, "file_truncated"},
                                                                 {ErrorCode::file_malformed, "file_malformed"},
                                                                 {ErrorCode::file_unsupported, "file_unsupported"},
                                                                 {ErrorCode::file_unwritable, "file_unwritable"},
                                                                 {ErrorCode::bad_key, "bad_key"},
                                                                 {ErrorCode::bad_type, "bad_type"},
                                                                 {ErrorCode::bad_value, "bad_value"},
                                                                 {ErrorCode::bad_mesh, "bad_mesh"},
                                                                 {ErrorCode::bad_map, "bad_map"},
                                                                 {ErrorCode::unsupported_pair, "unsupported_pair"},
                                                                 {ErrorCode::too_large, "too_large"},
                                                                 {ErrorCode::mismatch, "mismatch"}});
};

/// What went wrong, where, and what would have been accepted.
struct Error {
  ErrorCode code = ErrorCode::bad_value;
  std::string what;      ///< one sentence without a full stop
  std::string file;      ///< path as the user gave it; empty if no file is involved
  std::string place;     ///< key path ("surfaces[0].coat.height"), line ("line 12") or byte ("byte 84")
  std::string accepted;  ///< what would be accepted; may be empty

  /// "scene.json: surfaces[0].coat.height: is negative; accepted: a length above 0 (m, cm, mm, um, in)"
  [[nodiscard]] std::string message() const;
  /// The same error with `file` filled in where it was empty.
  [[nodiscard]] Error in_file(std::string path) && {
    if (file.empty()) file = std::move(path);
    return std::move(*this);
  }
  /// The same error with `prefix` put before its place.
  [[nodiscard]] Error at(const std::string& prefix) &&;
};

/// The Error of a value that is out of range: "is -1 m", where, and what would be accepted. [any]
Error bad_value(std::string what, std::string place, std::string accepted);
/// Any other error that no file is named in. [any]
Error refused(ErrorCode code, std::string what, std::string place = {}, std::string accepted = {});

namespace detail {
/// Says on standard error what was asked for in vain, and aborts: `error` is what is there in place of the value,
/// nullptr where there is a value in place of the error. [any]
#if defined(__GNUC__)
[[gnu::cold]]
#endif
[[noreturn]] void
wrong_side_of_result(const Error* error) noexcept;
}  // namespace detail

/// Value or Error. `[[nodiscard]]`: an ignored result is a defect. Asking an error for its value, or a value for its
/// error, ends the program with the error's words on standard error, in every build: ask ok() first.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : content_(std::in_place_index<0>, std::move(value)) {}      // NOLINT: implicit by design
  Result(Error error) : content_(std::in_place_index<1>, std::move(error)) {}  // NOLINT

  [[nodiscard]] bool ok() const { return content_.index() == 0; }
  explicit operator bool() const { return ok(); }

  [[nodiscard]] T& value() & { return *checked<0>(content_); }
  [[nodiscard]] const T& value() const& { return *checked<0>(content_); }
  [[nodiscard]] T&& value() && { return std::move(*checked<0>(content_)); }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T&& operator*() && { return std::move(*this).value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }

  [[nodiscard]] Error& error() & { return *checked<1>(content_); }
  [[nodiscard]] const Error& error() const& { return *checked<1>(content_); }
  [[nodiscard]] Error&& error() && { return std::move(*checked<1>(content_)); }

 private:
  template <std::size_t Side, class Content>
  static auto* checked(Content& content) {
    auto* there = std::get_if<Side>(&content);
    if (there == nullptr) [[unlikely]]
      detail::wrong_side_of_result(std::get_if<1>(&content));
    return there;
  }

  std::variant<T, Error> content_;
};

/// Success without a value, or an Error.
using Status = Result<std::monostate>;
/// The Status of what went well. [any]
inline Status success() {
  return Status(std::monostate{});
}

}  // namespace asperity

/// Evaluates a Result expression; on failure returns its Error from the enclosing function.
#define ASPERITY_TRY(declaration, expression) \
  ASPERITY_TRY_IMPL_(declaration, expression, ASPERITY_CONCAT_(result_, __LINE__))
#define ASPERITY_TRY_IMPL_(declaration, expression, name) \
  auto name = (expression);                               \
  if (!name) return std::move(name).error();              \
  declaration = std::move(name).value()
/// The same for a Status.
#define ASPERITY_CHECK(expression)                                                \
  do {                                                                            \
    if (auto status_ = (expression); !status_) return std::move(status_).error(); \
  } while (false)
#define ASPERITY_CONCAT_(a, b) ASPERITY_CONCAT_INNER_(a, b)
#define ASPERITY_CONCAT_INNER_(a, b) a##b
