#pragma once
// A device like the gelsight one, for the direct renderer's tables: a grey membrane of 24 x 18 mm on 3 mm of gel and
// 3 mm of acrylic, seen by a webcam from 16 mm below, lit from the plate's four sides by red, green, blue and white
// lamps.

#include "render/cameras/lens_camera.h"
#include "render/direct/light_field.h"
#include "render/scene/scene.h"

namespace touchstone::bench {

enum class Pressed { kNothing, kBall, kCoin };

/// Three lamps a side stand inside the plate and shine 8 to 30 degrees upwards. The ball has 2 mm radius and goes 0.6
/// mm deep; the coin is a relief of rim, rings and studs of 0.15 mm, 0.25 mm deep. About `triangles` triangles. `shift`
/// moves what presses (mm).
render::Scene gelsight_scene(Pressed pressed, int triangles, const render::Material& membrane, bool interreflection,
                             double shift = 0.0);

/// All that its membrane may reach.
Eigen::AlignedBox3d gelsight_reach();

/// 320 x 240 pixels (or others on the same sensor) on 17 x 13 mm; f/2.8, sharp on the membrane.
render::LensCamera gelsight_camera(int width, int height);

}  // namespace touchstone::bench
