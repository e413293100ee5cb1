#pragma once
// A request of HTTP as it comes in piece by piece, until it is there as a whole.

#include <cstddef>
#include <string>
#include <string_view>

namespace touchstone::apps {

/// Why a request isn't taken.
struct Refusal {
  int status = 400;
  std::string message;
};

/// The bytes of one request. What isn't HTTP or is too large is refused as soon as it can be seen.
class WholeRequest {
 public:
  /// Takes what has come. @returns whether the request is there as a whole @throws Refusal
  bool take(std::string_view bytes);
  /// As it is passed on: its first line; of its header lines Host, Origin, Content-Type and Content-Length; its body.
  /// @pre it's whole
  std::string text() const;

 private:
  std::string bytes_;  // of the head and then, once that is there, of the body
  std::string head_;   // as it is passed on; empty: not there yet
  std::size_t body_size_ = 0;
};

}  // namespace touchstone::apps
