#include "apps/whole_request.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>

#include "core/short_text.h"

namespace touchstone::apps {
namespace {

constexpr std::size_t kMostHead = 16 * 1024;
constexpr std::size_t kMostBody = 8 * 1024;  // of values by name; httplib takes no longer form
constexpr std::string_view kLineEnd = "\r\n";
constexpr std::string_view kHeadEnd = "\r\n\r\n";

/// What a head says, as far as it is passed on.
struct Head {
  std::string kept;  // the request line and header lines
  std::size_t body_size = 0;
};

std::string lower(std::string_view text) {
  std::string all(text);
  for (char& letter : all) letter = static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
  return all;
}

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

/// A lone line feed would be the end of a line to httplib. @throws Refusal
void refuse_control_characters(std::string_view line) {
  constexpr unsigned char kDelete = 0x7f;
  for (const char letter : line) {
    const auto code = static_cast<unsigned char>(letter);
    if ((code < ' ' && code != '\t') || code == kDelete) {
      throw Refusal{400, fmt::format("the line '{}' has a control character; only tabs are allowed", short_text(line))};
    }
  }
}

/// @param text up to the empty line @throws Refusal
Head read_head(std::string_view text) {
  const std::size_t first_end = std::min(text.find(kLineEnd), text.size());
  Head head{std::string(text.substr(0, first_end)), 0};
  refuse_control_characters(head.kept);
  text.remove_prefix(std::min(first_end + kLineEnd.size(), text.size()));
  bool has_length = false;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(kLineEnd), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + kLineEnd.size(), text.size()));
    refuse_control_characters(line);
    const std::size_t colon = line.find(':');
    if (colon == std::string_view::npos || colon == 0 || line.find_first_of(" \t") < colon) {
      throw Refusal{400, fmt::format("the header line '{}' isn't 'Name: value'", short_text(line))};
    }
    const std::string name = lower(line.substr(0, colon));
    const std::string_view value = trimmed(line.substr(colon + 1));
    if (name == "transfer-encoding") {
      throw Refusal{411,
                    fmt::format("Transfer-Encoding: '{}' isn't taken; a body's length must be given by Content-Length",
                                short_text(value))};
    }
    if (name == "content-length") {
      const char* last = value.data() + value.size();
      std::size_t size = 0;
      const auto [stop, error] = std::from_chars(value.data(), last, size);
      const bool digits = !value.empty() && stop == last;
      if (has_length || !digits || (error != std::errc() && error != std::errc::result_out_of_range)) {
        throw Refusal{400,
                      fmt::format("Content-Length: '{}' isn't allowed; one whole number from 0 is", short_text(value))};
      }
      if (error != std::errc() || size > kMostBody) {
        throw Refusal{
            413, fmt::format("Content-Length: {} bytes are too many; {} are allowed", short_text(value), kMostBody)};
      }
      has_length = true;
      head.body_size = size;
    }
    if (name == "host" || name == "origin" || name == "content-type") {
      head.kept += fmt::format("{}{}", kLineEnd, line);
    }
  }
  head.kept += fmt::format("{}Content-Length: {}", kLineEnd, head.body_size);
  return head;
}

}  // namespace

bool WholeRequest::take(std::string_view bytes) {
  const std::size_t seen = bytes_.size();
  bytes_ += bytes;
  if (bytes_.empty()) return false;
  if (head_.empty()) {
    if (!std::isupper(static_cast<unsigned char>(bytes_.front()))) {
      throw Refusal{400, fmt::format("a request starts with a method, such as GET, not with '{}'",
                                     short_text(bytes_.substr(0, 1)))};
    }
    const std::size_t end = bytes_.find(kHeadEnd, seen - std::min(seen, kHeadEnd.size() - 1));
    if (std::min(end, bytes_.size()) > kMostHead) {
      throw Refusal{431, fmt::format("the request's head is too long; {} bytes are allowed", kMostHead)};
    }
    if (end == std::string::npos) return false;
    Head head = read_head(std::string_view(bytes_).substr(0, end));
    head_ = std::move(head.kept) + std::string(kHeadEnd);
    body_size_ = head.body_size;
    bytes_.erase(0, end + kHeadEnd.size());
  }
  return bytes_.size() >= body_size_;
}

std::string WholeRequest::text() const {
  return head_ + bytes_.substr(0, body_size_);
}

}  // namespace touchstone::apps
