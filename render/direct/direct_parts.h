#pragma once
// What a DirectRenderer keeps from frame to frame, and how it is set up (direct_parts.cpp); direct_renderer.cpp draws.

#include <Eigen/Geometry>
#include <array>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "core/triangle_mesh.h"
#include "render/cameras/camera_footprint.h"
#include "render/cameras/camera_rays.h"
#include "render/direct/direct_batch.h"
#include "render/direct/direct_fixture.h"
#include "render/direct/direct_renderer.h"
#include "render/direct/shadow_reach.h"
#include "render/direct/sheet_horizons.h"
#include "render/direct/sheet_points.h"
#include "render/materials/ggx.h"
#include "render/scene/packet_scene.h"

namespace touchstone::render {

/// All that a renderer keeps from frame to frame.
struct DirectRenderer::Parts {
  DirectFixture fixture;
  ReadyCamera camera;
  DirectSettings settings;
  float pixel_mm;                // between the rays of pixels beside each other, in the middle of the field's box
  Eigen::AlignedBox2d seen_box;  // x and y of all that rays to the field's layer pass between its lowest and highest
  std::optional<HorizonSettings> horizon_settings;  // where one sample is taken and light comes from one side
  bool lone_sheet;  // the first surface alone moves: asked for by SheetIndex and SheetHorizons, not in `tree`
  std::vector<TriangleMesh> others;  // of a lone sheet: all but the first surface, at rest
  PacketScene tree;
  std::vector<Surface> films;
  bool connected;        // the first surface
  bool spreads;          // central rays, then the footprint
  bool refines = false;  // more rays at edges
  CameraFootprint footprint;
  CameraRays rays;
  // By pixel and band, where central rays are spread; see CameraRays.
  std::vector<float> through, veil;
  std::vector<float> radiance;                // [band][grid point], memory for a frame
  std::vector<DirectBatch::Visibility> seen;  // by grid point, where edges get more rays
  std::vector<std::int32_t> sheet_triangles;  // by grid point, the first surface's triangle or -1; memory for a frame
  std::vector<float> bounced;                 // [grid point][band], irradiance; empty for none
  std::vector<float> rest_normals;  // [grid point][axis] of the sheet that `bounced` is of, 0 beside it; or empty
  std::vector<float> rest_sends;    // [grid point][band], irradiance times albedo
  std::map<double, GgxAlbedo> conductors;  // by roughness

  Parts(const LightField& field, const Camera& camera_of, const Scene& rest,
        const DirectSettings& settings_of);  ///< as DirectRenderer's

  int width() const { return size_of_grid(pixel_grid(camera)).x(); }
  int height() const { return size_of_grid(pixel_grid(camera)).y(); }
  /// Does the first surface alone move, as far as a scene at rest says, and do horizons say where it casts shadows?
  bool is_lone_sheet(const Scene& rest) const { return horizon_settings && is_sheet_alone(fixture.bearings, rest); }
  /// Does all but the first surface stand where it stood at rest?
  bool stands_still(const Scene& scene) const;

  /// Casts the rays and shades what they meet: into `radiance`, or into the picture where nothing is spread.
  void cast(const DirectFrame& frame, const SamplePart& part, DirectImage& image);
  /// Casts more rays where `radiance` has edges.
  void refine(const DirectFrame& frame, DirectImage& image);
  /// The bounced light at what a lane has met, null where there's none; kept in `memory`.
  const float* bounced_at(const DirectBatch& batch, int lane, std::size_t point, float* memory) const;
  /// From `sheet_triangles` to pixels; nothing where grid points aren't pixels.
  std::vector<std::int32_t> triangles_by_pixel() const;
  /// From `radiance` to the picture.
  void spread(DirectImage& image) const;

  struct Prepared;
  /// Looks a scene over and gets all ready that its rays will ask for. @throws Error as render
  std::unique_ptr<Prepared> prepare(const Scene& scene);
  /// What the rays of one picture meet of the sheet, its first surface.
  SheetPoints points_of(const DirectFrame& frame, const Surface& sheet) const;

 private:
  DirectBatch::Visibility known_round(int point) const;

  static Eigen::Vector2i size_of_grid(const ImageGrid& grid) { return {grid.columns, grid.rows}; }

  /// What the hole or lens sees of a point at rest it sees through a disc of the films' plane; lamps' light rises to
  /// the membrane so flat that it comes from about as far aside as films are below.
  void set_up_films(const Scene& rest);

  /// The footprint on what the scene shows at rest, by block; in the middle of the field's box where it shows nothing.
  void find_footprint(const Scene& rest);

  std::optional<HorizonSettings> find_horizon_settings() const;

  /// The scene with nothing of its first surface.
  static Scene still_things(const Scene& rest);

  /// Of a coarse grid of pixels, with what lies beside the outermost by half its spacing and by the blur.
  Eigen::AlignedBox2d find_seen_box() const;

  float find_pixel() const;

  void keep_by_pixel(const CameraRays& pixels, const std::vector<float>& from, std::vector<float>& to) const;
};

}  // namespace touchstone::render
