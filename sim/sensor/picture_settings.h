#pragma once
// How well the pictures of a scene are traced.

#include "render/imager/imager.h"
#include "render/paths/path_tracer.h"
#include "sim/scene/scene.h"

namespace touchstone::sim {

/// Paths until a pixel's error is `fraction` of the imager's noise. Electrons are those of all channels together, as
/// many as the one that sees most: a lamp of one colour counts even if the first samples of a pixel never chose it.
render::NoiseTarget noise_target(const render::ImagerResponse& response, double fraction);

/// Of a scene's pictures.
render::RenderSettings picture_settings(const SceneSpec& scene, const render::ImagerResponse& response);

/// Of key frames: their light stays in other frames where nothing changes, so it is rendered better than theirs. The
/// first one stands for the gel at rest and gets more paths yet.
render::RenderSettings key_frame_settings(const SceneSpec& scene, const render::ImagerResponse& response, bool first);

/// After the first frame one in so many is a key: 2 or 3 % more work, which pays where frames are so dense that those
/// next to each other are alike. Where a key needs the most samples there are edges, which other frames don't have in
/// the same place: it gets no more of them than they do.
inline constexpr std::size_t kFramesPerKey = 50;

}  // namespace touchstone::sim
