#pragma once
// Sixteen pixels' worth of direct light: what the rays met, which lamps reach it, what comes back.

#include <array>
#include <cstdint>
#include <vector>

#include "render/camera_rays.h"
#include "render/ggx.h"
#include "render/light_field.h"
#include "render/packet_scene.h"
#include "render/shadow_reach.h"
#include "render/warps.h"

namespace touchstone::render {

inline constexpr int kMostDirectLamps = 64;

enum class DirectKind { kMatt, kMetal, kLuminous, kBlack };

struct DirectMaterial {
  DirectKind kind = DirectKind::kBlack;
  std::array<float, kMaxBands> colour{};  ///< albedo, reflectance at normal incidence, or radiance
  double roughness = 0.0;
  const GgxAlbedo* albedo = nullptr;  ///< of a metal
};

/// What stays the same from frame to frame, besides the camera's rays.
struct DirectFixture {
  LightField field;
  std::vector<NormalFrame> lens_frames;
  std::vector<double> lens_radii;  ///< mm, 0 for lamps that aren't round
  std::vector<double> lamp_index;  ///< refractive index of the medium that a lamp stands in
  std::vector<bool> lamp_in_layer;
  double low, high;  ///< of the field's layer
  std::array<float, kMaxBands> absorption{};
  bool absorbs = false;

  explicit DirectFixture(const LightField& of);
};

/// What a frame consists of.
struct DirectFrame {
  const DirectFixture& fixture;
  const PacketScene& tree;
  const ShadowReach& shadow_reach;
  const std::vector<DirectMaterial>& materials;  ///< by object
};

struct DirectCounts {
  std::uint64_t primary = 0, shadow_rays = 0, spared = 0;
};

/// One at a time for each thread: it is room to work in. Steps are to be called in their order.
class DirectPacket {
 public:
  explicit DirectPacket(const DirectFrame& frame);

  /// What the rays meet and what each lamp would send there.
  void look(const RayPacket& rays, DirectCounts& counts);

  /// Lets a lane's shadows come from the point of each lens that (u, v) in [0, 1)^2 stands for, not from its middle.
  void choose_lens_points(int lane, double u, double v);

  /// Takes away what doesn't get through.
  void cast_shadows(DirectCounts& counts);

  /// Adds a lane's light to `out`, a number a band. `through` is that of CameraRays.
  void add(int lane, const float* through, float* out) const;

 private:
  struct LampLight {
    float amount[kPacket];      // cosine times irradiance of unit intensity
    float towards[3][kPacket];  // where it comes from, not of unit length
  };

  void light_lane(int lane);
  void shadow_ray(int lane, int lamp);
  void add_reflected(int lane, const DirectMaterial& material, const float* dimmed, float* out) const;

  const DirectFrame& frame_;
  const LightField& field_;
  int lamps_, bands_;
  const RayPacket* rays_ = nullptr;
  PacketHits hits_;
  RayPacket shadow_;
  float place_[3][kPacket];
  float normal_[3][kPacket];        // unit, facing the camera's ray
  float safe_steepness2_[kPacket];  // see ShadowReach; squared
  const DirectMaterial* material_[kPacket];
  std::vector<LampLight> light_;
  std::vector<float> pass_;  // [lane][lamp][band], empty where nothing absorbs
};

}  // namespace touchstone::render
