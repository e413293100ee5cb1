#pragma once
// Some hundred rays' worth of direct light: what the rays met, which lamps reach it, what comes back.

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "render/cameras/camera_rays.h"
#include "render/direct/direct_fixture.h"
#include "render/direct/direct_material.h"
#include "render/direct/packet_horizons.h"
#include "render/direct/sheet_horizons.h"
#include "render/scene/packet_scene.h"
#include "render/scene/sheet_index.h"

namespace touchstone::render {

/// What a frame consists of.
struct DirectFrame {
  const DirectFixture& fixture;
  const PacketScene& tree;
  const SheetIndex* sheet;                       ///< of the first surface, where that isn't in the tree; else null
  const ShadowReach* shadow_reach;               ///< null: no shadow is asked for by rays; of what is in the tree
  const SheetHorizons* horizons;                 ///< of the first object, where it alone casts shadows; else null
  const std::vector<DirectMaterial>& materials;  ///< by object
};

/// How many rays were cast; `spared` shadow rays weren't needed (ShadowReach).
struct DirectCounts {
  std::uint64_t primary = 0, shadow_rays = 0, spared = 0;
};

/// One at a time for each thread: it is working memory. Steps are to be called in their order. Lane k is lane k % 16
/// of packet k / 16.
class DirectBatch {
 public:
  static constexpr int kMostPackets = 16;

  /// Allocates kMostPackets packets. The frame must outlive this.
  explicit DirectBatch(const DirectFrame& frame);

  /// What the rays meet and what each lamp would send there; at most kMostPackets.
  void intersect(std::span<const RayPacket> rays, DirectCounts& counts);

  /// Lets a lane's shadows come from the point of each lens that (u, v) in [0, 1)^2 stands for, not from its middle,
  /// and from that part of a guide's beams. Without, the sixteen lanes of a packet take sixteen parts of a beam.
  void choose_lens_points(int lane, double u, double v);

  /// Which lamps' light is known to reach a place, and which is known to be hidden: a bit a lamp.
  struct Visibility {
    std::uint64_t open = 0, hidden = 0;
  };
  /// Takes that for a lane, so that no shadow ray asks.
  void take_as_known(int lane, const Visibility& known);
  /// Takes away what doesn't get through.
  void cast_shadows(DirectCounts& counts);

  /// What the lane has found; lamps that its surface turns away from are in neither.
  Visibility visibility(int lane) const;

  /// Where a lane has met the first surface, if that is matt there; else nothing. As long as the lane's rays are kept.
  struct SheetPlace {
    const float* place;   ///< mm
    const float* normal;  ///< the one that it is shaded by: unit, facing the camera's ray
    int triangle;
    float u, v;
  };
  std::optional<SheetPlace> sheet_place(int lane) const;  ///< see above
  /// The triangle of the first surface that a lane's ray met; -1 where it met something else, or nothing.
  int sheet_triangle(int lane) const {
    const Lane& one = lanes_[lane];
    const bool met = packet_of(lane).valid[lane % kPacket] != 0 && one.material != nullptr && one.object == 0;
    return met ? one.triangle : -1;
  }
  /// What a white sheet in the place of a lane's would show, as SheetPoints::values has it: 4 floats a band. `ambient`
  /// as in add(). @pre sheet_place(lane); no films
  void white_light(int lane, const float* ambient, float* out) const;

  /// Irradiance that lamps give a lane's sheet times its albedo, that of its unprinted material: a number a band.
  /// `ambient` as in add(). @pre sheet_place(lane); no films
  void sent_back(int lane, const float* ambient, float* out) const;

  /// Adds a lane's light to `out`, a number a band: `through` (that of CameraRays) times basic radiance. `ambient`, if
  /// any, is an irradiance from everywhere, W/m^2 a band, that comes on top.
  void add(int lane, const float* through, const float* ambient, float* out) const;

 private:
  struct Lane {
    float place[3];
    float normal[3];  // the shading normal: unit, facing the camera's ray
    float leave[3];   // where shadow rays start
    float distance;
    int object;
    const DirectMaterial* material;  // null where nothing was met
    const float* colour;             // the material's, or that of the ink
    std::uint64_t doubt;             // see ShadowReach
    float spread[2];                 // where in the beams of guides shadow rays go, each -1/2 to 1/2
    int triangle;                    // met
    float u, v;                      // on it
    float film;                      // the part of the camera's rays to it that goes through film
  };

  using Four = Eigen::Array4f;
  static Eigen::Map<const Four> four(const float* from) { return Eigen::Map<const Four>(from); }

  const RayPacket& packet_of(int lane) const { return rays_[lane / kPacket]; }
  /// Has the lane's ray met something that lamps light?
  bool takes_light(int lane) const {
    const Lane& one = lanes_[lane];
    return packet_of(lane).valid[lane % kPacket] != 0 && one.material != nullptr && is_lit(one.material->kind);
  }
  float* amounts(int lane) { return amounts_.data() + static_cast<std::size_t>(lane) * stride_; }
  const float* amounts(int lane) const { return amounts_.data() + static_cast<std::size_t>(lane) * stride_; }
  Four passing(int lane, int group, int band) const;
  Eigen::Vector3f flow_of(int lane, int lamp) const;
  Eigen::Vector3f direction_to(int lane, int lamp) const;
  Eigen::Vector3f towards(int lane, int lamp) const;
  void set_flow(int lane, int lamp, const Eigen::Vector3f& flow);
  void meet_sheet(const RayPacket& packet, PacketHits& hits) const;
  float film_before(const RayPacket& packet, int slot, float distance) const;
  void light_lane(int lane, DirectCounts& counts);
  void find_beams(int lane);
  void dim_by_horizons(int packet);
  float soft_width(int lane, int lamp, float tangent) const;
  void reflect_through_films(int lane, float* sum) const;
  bool shadow_ray(int lane, int lamp, int slot);
  void trace_shadows(int lamp, const int* lanes, int count, DirectCounts& counts);
  float irradiance(int lane, int band) const;
  void reflect_from_matt(int lane, float* sum) const;
  void reflect_from_metal(int lane, float* sum) const;

  const DirectFrame& frame_;
  const DirectFixture& fixture_;
  const LightField& field_;
  int lamps_, bands_;
  std::size_t stride_;  // of amounts_: lamps, filled up to a multiple of four
  std::span<const RayPacket> rays_;
  std::vector<Lane> lanes_;
  std::vector<float> amounts_;  // [lane][lamp]: cosine times irradiance of unit intensity
  std::vector<float> flows_;    // [lane][group][axis][4]
  std::vector<float>
      directions_;  // likewise, where shadows are in doubt: unit vectors against the flows, 0 where there's none
  std::vector<float> pass_;  // [lane][band][lamp], empty where nothing absorbs
  RayPacket shadow_;
  BeamElevations beams_;  // once for the places of a packet, which lie close together
  PacketHorizons around_{};
  std::vector<float> shares_;  // [beam][lane of a packet]
};

}  // namespace touchstone::render
