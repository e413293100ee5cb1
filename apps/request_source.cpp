#include "apps/request_source.h"

#include <arpa/inet.h>

#include <algorithm>
#include <cctype>
#include <string_view>

#include "core/error.h"

namespace touchstone::apps {
namespace {

bool same_name(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](char one, char other) {
    return std::tolower(static_cast<unsigned char>(one)) == std::tolower(static_cast<unsigned char>(other));
  });
}

bool is_port(std::string_view text) {
  constexpr std::size_t kMostDigits = 5;
  return !text.empty() && text.size() <= kMostDigits && text.find_first_not_of("0123456789") == std::string_view::npos;
}

/// Without a port; empty if it isn't a host.
std::string name_of(std::string_view host) {
  if (host.starts_with('[')) {
    const std::size_t end = host.find(']');
    if (end == std::string_view::npos) return {};
    const std::string_view after = host.substr(end + 1);
    if (!after.empty() && !(after.starts_with(':') && is_port(after.substr(1)))) return {};
    return std::string(host.substr(0, end + 1));
  }
  const std::size_t colon = host.find(':');
  if (colon != std::string_view::npos && !is_port(host.substr(colon + 1))) return {};
  return std::string(host.substr(0, colon));
}

bool is_address(const std::string& name) {
  in_addr four{};
  in6_addr six{};
  if (name.starts_with('[')) return inet_pton(AF_INET6, name.substr(1, name.size() - 2).c_str(), &six) == 1;
  return inet_pton(AF_INET, name.c_str(), &four) == 1;
}

}  // namespace

bool host_is_allowed(const std::string& host, const AllowedSources& allowed) {
  const std::string name = name_of(host);
  if (name.empty()) return false;
  if (is_address(name) || same_name(name, "localhost")) return true;
  return std::any_of(allowed.hosts.begin(), allowed.hosts.end(),
                     [&](const std::string& one) { return same_name(one, name); });
}

bool origin_is_allowed(const std::string& origin, const std::string& host, const AllowedSources& allowed) {
  if (same_name(origin, "http://" + host)) return true;
  return std::find(allowed.origins.begin(), allowed.origins.end(), origin) != allowed.origins.end();
}

void check(const AllowedSources& allowed) {
  for (const std::string& host : allowed.hosts) {
    if (name_of(host) != host || host.empty()) fail("--host {}: must be a name without a port, as sensor.local", host);
  }
  for (const std::string& origin : allowed.origins) {
    const std::size_t scheme = origin.find("://");
    const bool is_origin = scheme != std::string::npos && scheme > 0 && scheme + 3 < origin.size() &&
                           origin.find_first_of("/?#", scheme + 3) == std::string::npos;
    if (!is_origin) fail("--allow-origin {}: must be as http://localhost:3000, without a path", origin);
  }
}

}  // namespace touchstone::apps
