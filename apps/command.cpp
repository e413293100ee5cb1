#include "apps/command.h"

#include <array>

#include "core/error.h"
#include "core/nearest_name.h"

namespace touchstone::apps {

void require_writable_place(const std::filesystem::path& file) {
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
  if (!std::filesystem::is_directory(folder)) fail("{}: there is no folder {}", file.string(), folder.string());
  if (std::filesystem::is_directory(file)) fail("{}: is a folder; a file is wanted here", file.string());
}

void require_known_sensor(const std::string& sensor) {
  static const std::array<std::string, 1> kKnown = {"vhs"};
  if (std::find(kKnown.begin(), kKnown.end(), sensor) != kKnown.end()) return;
  fail("'{}' is no sensor with an estimator{}; allowed is: {}", sensor, did_you_mean(sensor, kKnown),
       fmt::join(kKnown, ", "));
}

}  // namespace touchstone::apps
