#include "asperity/core/result.h"

#include <cstdio>
#include <cstdlib>

namespace asperity {

const char* to_string(ErrorCode code) {
  switch (code) {
    case ErrorCode::file_missing: return "file_missing";
    case ErrorCode::file_empty: return "file_empty";
    case ErrorCode::file_truncated: return "file_truncated";
    case ErrorCode::file_malformed: return "file_malformed";
    case ErrorCode::file_unsupported: return "file_unsupported";
    case ErrorCode::file_unwritable: return "file_unwritable";
    case ErrorCode::bad_key: return "bad_key";
    case ErrorCode::bad_type: return "bad_type";
    case ErrorCode::bad_value: return "bad_value";
    case ErrorCode::bad_mesh: return "bad_mesh";
    case ErrorCode::bad_map: return "bad_map";
    case ErrorCode::unsupported_pair: return "unsupported_pair";
    case ErrorCode::too_large: return "too_large";
    case ErrorCode::mismatch: return "mismatch";
  }
  return "unknown";
}

std::string Error::message() const {
  std::string text;
  if (!file.empty()) text += file + ": ";
  if (!place.empty()) text += place + ": ";
  text += what;
  if (!accepted.empty()) text += "; accepted: " + accepted;
  return text;
}

Error Error::at(const std::string& prefix) && {
  if (place.empty()) {
    place = prefix;
  } else if (!prefix.empty()) {
    place = place.front() == '[' ? prefix + place : prefix + "." + place;
  }
  return std::move(*this);
}

void detail::wrong_side_of_result(const Error* error) noexcept {
  if (error != nullptr) {
    std::fprintf(stderr, "asperity: the value of a failed result was asked for: %s (%s)\n", error->message().c_str(),
                 to_string(error->code));
  } else {
    std::fputs("asperity: the error of a result that went well was asked for\n", stderr);
  }
  std::abort();
}

}  // namespace asperity
