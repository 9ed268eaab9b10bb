#include "asperity/core/result.h"

#include <cstdio>
#include <cstdlib>

namespace asperity {

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

Error bad_value(std::string what, std::string place, std::string accepted) {
  return refused(ErrorCode::bad_value, std::move(what), std::move(place), std::move(accepted));
}
Error refused(ErrorCode code, std::string what, std::string place, std::string accepted) {
  return {code, std::move(what), {}, std::move(place), std::move(accepted)};
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
