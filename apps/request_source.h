#pragma once
// Which names a server answers to and which web pages may use it. A browser sends a page's requests to any address;
// only Host and Origin say whose they are.

#include <optional>
#include <string>
#include <vector>

namespace touchstone::apps {

/// Besides addresses and localhost, which nobody else can make point here.
struct AllowedSources {
  std::vector<std::string> hosts;    ///< names, without a port
  std::vector<std::string> origins;  ///< such as "http://example.org:8000"
};

/// Whether `host` (a Host header, "NAME", "NAME:PORT" or "[V6]:PORT") is an address, localhost or an allowed name.
/// Another name may be one of a foreign site that is made to point here ("DNS rebinding").
bool host_is_allowed(const std::string& host, const AllowedSources& allowed);

/// Whether `origin` (an Origin header) is the server's own page under `host`, or an allowed one.
bool origin_is_allowed(const std::string& origin, const std::string& host, const AllowedSources& allowed);

/// @throws Error naming the option if a value can't be a host's name or an origin
void check(const AllowedSources& allowed);

}  // namespace touchstone::apps
