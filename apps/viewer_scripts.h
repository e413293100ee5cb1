#pragma once

#include <optional>

#include "datasets/inspection/inspection_page.h"

namespace touchstone::apps {

/// three.js as this program was built with it (from Debian's libjs-three); nothing where it wasn't there.
std::optional<datasets::ViewerScripts> viewer_scripts();

}  // namespace touchstone::apps
