#pragma once
// The presses of a fit that come from a recording of balls: a table of pictures and circles, in place of poses and
// balanced pictures.

#include <filesystem>

#include "core/progress.h"
#include "lab/fit/unit_fit_spec.h"

namespace touchstone::lab {

/// The fit with its recording's presses and rest pictures as `presses` and `backgrounds`. Circles are given or found
/// (read_ball_recording), each frame's own white balance is taken out, places are those of the circles' middles, and
/// depths those at which the device's contacts are as wide. A circle that is wider than the deepest press gives is
/// pressed to that, which `doubts` say. A fit without a recording comes back as it is.
/// @throws Error as read_ball_recording and check_recorded_by; with the place in the fit's file for a name that no
/// press has, and for a press whose middle isn't over the gel
UnitFitSpec with_recording(UnitFitSpec spec, const std::filesystem::path& cache_folder, const Progress& progress = {});

}  // namespace touchstone::lab
