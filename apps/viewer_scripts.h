#pragma once

#include <optional>

#include "lab/inspection_page.h"

namespace touchstone::apps {

/// three.js as this program was built with it (from Debian's libjs-three); nothing where it wasn't there.
std::optional<lab::ViewerScripts> viewer_scripts();

}  // namespace touchstone::apps
