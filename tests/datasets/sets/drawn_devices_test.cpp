// Jobs that draw on each kind of device, small: made whole and in shards, and what each kind's arrays hold.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/hdf5_file.h"
#include "datasets/sets/block_record.h"
#include "datasets/sets/generate.h"
#include "tests/support/message_of.h"
#include "tests/support/small_draw.h"
#include "tests/support/small_job.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::datasets {
namespace {

using test::message_of;
using ::testing::HasSubstr;

constexpr const char* kGel = R"(
gel: {size_x_mm: 8, size_y_mm: 8, thickness_mm: 2, youngs_modulus_MPa: 0.2, poisson_ratio: 0.49, refractive_index: 1.41MORE}
mesh: {fine_mm: 0.8, coarse_mm: 2, fine_half_extent_mm: [2.5, 2.5], fine_depth_mm: 1}
)";

std::string gel(const std::string& more = "") {
  std::string text = kGel;
  return text.replace(text.find("MORE"), 4, more);
}

constexpr const char* kLens = R"(
  type: lens
  focal_length_mm: 3
  f_number: 4
  focus_distance_mm: 17
  lens_position_mm: [0, 0, -19]
  look_at_mm: [0, 0, 0]
  full_well_e: 50000
)";

/// Beads in a clear gel.
std::string clear_device() {
  return "name: clear" + gel() + R"(
beads: {grid: 2, spacing_mm: 2, diameter_mm: 0.6, depth_mm: 0.8}
plate: {thickness_mm: 1, refractive_index: 1.5}
lamps:
  - {position_mm: [0, -10, -16], target_mm: [0, 0, -2], lens_radius_mm: 1, half_angle_deg: 25, power_W: [3, 3, 3]}
room_radiance: 0.1
camera:
  width: 32
  height: 24
  pixel_pitch_um: 90
  exposure_us: 500)" +
         std::string(kLens);
}

/// A milky membrane before the room, with event pixels.
std::string milky_device() {
  return "name: milky" + gel(", scattering_per_mm: 2, scattering_anisotropy: 0.8, frame_albedo: 1") + R"(
plate: {thickness_mm: 3, refractive_index: 1.49}
room_radiance: 0.5
room_radiance_behind: 0.2
band_wavelengths_nm: [550]
camera:
  width: 32
  height: 24
  pixel_pitch_um: 50
  active_area_um2: 300
  exposure_us: 2000
  events: {on_threshold: 0.1, off_threshold: 0.1, dark_e_per_s: 1000})" +
         std::string(kLens);
}

/// White dots on a black skin, before a motion chip.
std::string chip_device() {
  return "name: chip" + gel() + R"(
plate: {thickness_mm: 1, refractive_index: 1.5}
coating: {type: matt, albedo: 0.04, print: {grid: [5, 5], spacing_mm: [1.5, 1.5], shape: round, diameter_mm: 0.7, colour: 0.85}}
lamps:
  - {type: led_ring, centre_mm: [0, 0, -15.6], ring_radius_mm: 7.2, count: 6, target_mm: [0, 0, -1], chip_radius_mm: 0.3,
     viewing_angle_deg: 120, power_W: 0.002}
band_wavelengths_nm: [640]
camera:
  preset: adns2620
  type: lens
  focal_length_mm: 1.8
  f_number: 6
  lens_position_mm: [0, 0, -15.67]
  look_at_mm: [0, 0, 0]
  exposure_us: 620
  motion_chip: {automatic_shutter: true, darkest_maximum: 45, brightest_maximum: 62}
)";
}

constexpr const char* kJob = R"(name: kinds
seed: 3
samples: 6
samples_per_file: 2
membrane_um: 120
draw:
  device: kind.yaml
  units: {count: 2, vary: [{path: gel.youngs_modulus_MPa, times: {uniform: [0.8, 1.2]}}]}
  objects:
    - {file: OBJECT, vary: [{path: shape.radius_mm, set: {uniform: [1, 2]}}]}
  place_mm: {x: {uniform: [-1, 1]}, y: {uniform: [-1, 1]}}
  force_N: {log_uniform: [0.05, 0.2]}
  drag_mm: {uniform: [0, 0.1]}
outputs: [OUTPUTS]
)";

class DrawnDevices : public ::testing::Test {
 protected:
  std::filesystem::path job(const std::string& device, const std::string& outputs,
                            const std::string& object = "ball.yaml", int units = 2) {
    test::write_small_draw(folder_);
    if (object == "dark.yaml") {
      folder_.write("dark.yaml", "name: dark\nshape: {type: sphere, radius_mm: 1.5}\nalbedo: 0.03\nfriction: 0.5\n");
    }
    folder_.write("kind.yaml", device);
    std::string text = kJob;
    text.replace(text.find("OBJECT"), 6, object);
    text.replace(text.find("OUTPUTS"), 7, outputs);
    text.replace(text.find("count: 2"), 8, fmt::format("count: {}", units));
    return folder_.write("job.yaml", text);
  }

  GenerateReport generate(const std::filesystem::path& job, const std::string& out, Shard shard = {}) {
    GenerateOptions options;
    options.sensors = virtual_sensors(folder_.path() / "cache");
    options.threads = 2;
    options.shard = shard;
    return touchstone::datasets::generate(job, folder_.path() / out, options);
  }

  /// Made whole and in two shards. @returns the first block of the whole one
  Hdf5Reader make(const std::filesystem::path& job) {
    EXPECT_EQ(generate(job, "whole").made, 6);
    generate(job, "parts", {2, 2});
    generate(job, "parts", {1, 2});
    EXPECT_EQ(merge(job, folder_.path() / "parts").samples, 6);
    EXPECT_EQ(test::contents_of(folder_.path() / "parts"), test::contents_of(folder_.path() / "whole"));
    return Hdf5Reader(folder_.path() / "whole/blocks/000000.h5");
  }

  test::TemporaryFolder folder_;
};

TEST_F(DrawnDevices, AClearGelHasItsBeads) {
  const Hdf5Reader file = make(job(clear_device(), "frame, contact, beads, traction"));
  EXPECT_EQ(file.extents("/frame"), (std::vector<std::int64_t>{2, 24, 32, 1}));
  EXPECT_EQ(file.extents("/bead_displacement"), (std::vector<std::int64_t>{2, 4, 3}));
  EXPECT_EQ(file.extents("/bead_places"), (std::vector<std::int64_t>{4, 3}));
  const auto beads = file.read<double>("/bead_displacement").values;
  double lowest = 0.0;
  for (std::size_t k = 2; k < beads.size(); k += 3) lowest = std::min(lowest, beads[k]);
  EXPECT_LT(lowest, -0.005) << "a press of 0.05 N and more moves a bead down";
  const auto vertices = file.extents("/gel_vertices");
  EXPECT_EQ(file.extents("/traction"), (std::vector<std::int64_t>{2, vertices[0], 3}));
}

TEST_F(DrawnDevices, AMilkyGelHasHeightsAndEvents) {
  const Hdf5Reader file = make(job(milky_device(), "frame, height, contact, events", "dark.yaml", 1));
  const auto count = file.read<std::int64_t>("/events/count").values;
  ASSERT_EQ(count.size(), 2u);
  EXPECT_GT(count[0], 10);
  const auto t = file.read<std::int64_t>("/events/t_us").values;
  ASSERT_EQ(static_cast<std::int64_t>(t.size()), count[0] + count[1]);
  EXPECT_TRUE(std::is_sorted(t.begin(), t.begin() + count[0]));
  const auto height = file.read<float>("/height").values;
  const auto contact = file.read<std::uint8_t>("/contact").values;
  float deepest = 0.0F, touched = 0.0F;
  for (std::size_t k = 0; k < height.size(); ++k) {
    if (std::isfinite(height[k])) deepest = std::max(deepest, height[k]);
    if (contact[k] != 0) touched = std::max(touched, height[k]);
  }
  EXPECT_GT(deepest, 0.02F);
  EXPECT_EQ(touched, deepest) << "the deepest place is one that touches";
}

TEST_F(DrawnDevices, AMotionChipTellsStatistics) {
  const Hdf5Reader file = make(job(chip_device(), "frame, statistics, markers"));
  EXPECT_EQ(file.extents("/frame"), (std::vector<std::int64_t>{2, 18, 18, 1}));
  const auto frame = file.read<std::uint8_t>("/frame").values;
  const auto statistics = file.read<double>("/statistics").values;
  ASSERT_EQ(statistics.size(), 12u);
  for (int sample = 0; sample < 2; ++sample) {
    const auto [low, high] = std::minmax_element(frame.begin() + 324 * sample, frame.begin() + 324 * (sample + 1));
    EXPECT_EQ(statistics[static_cast<std::size_t>(6 * sample) + 2], *high);
    EXPECT_EQ(statistics[static_cast<std::size_t>(6 * sample) + 3], *low);
  }
  EXPECT_EQ(file.extents("/marker_displacement"), (std::vector<std::int64_t>{2, 25, 3}));
}

TEST_F(DrawnDevices, MechanicsAloneNeedNeitherPlateNorCamera) {
  const Hdf5Reader file = make(job("name: pad" + gel(), "traction"));
  EXPECT_FALSE(file.has("/background"));
  const auto wrench = file.read<double>("/wrench").values;
  EXPECT_GT(wrench[2], 0.04);
}

TEST_F(DrawnDevices, ElasticObjectsArePressed) {
  // Edges that the contact is wide beside: on a single vertex one force makes one depth, whatever presses.
  std::string device = "name: pad" + gel();
  device.replace(device.find("fine_mm: 0.8"), 12, "fine_mm: 0.4");
  const auto of = [&](const char* name, const std::string& more) {
    folder_.write(name, "name: ball\nshape: {type: sphere, radius_mm: 1.5}\n" + more);
    return job(device, "", name);
  };
  const auto depth = [&](const std::filesystem::path& job, const std::string& out) {
    generate(job, out);
    return Hdf5Reader(folder_.path() / out / "blocks/000000.h5").read<double>("/deepest_mm").values.front();
  };
  const double rigid = depth(of("rigid.yaml", ""), "rigid");
  const double soft =
      depth(of("soft.yaml", "elastic: {youngs_modulus_MPa: 0.2, poisson_ratio: 0.45, mesh_mm: 0.4}\n"), "soft");
  // A soft ball spreads the same force over more of the gel: 0.79 of the depth between half-spaces [Hertz1882], 0.76
  // here.
  EXPECT_LT(soft, 0.85 * rigid);
  EXPECT_GT(soft, 0.65 * rigid);
}

TEST_F(DrawnDevices, WhatADeviceCannotGiveIsRefusedByName) {
  const auto refused = [&](const std::string& device, const std::string& outputs) {
    return message_of([&] { prepare_draw(job(device, outputs)); });
  };
  EXPECT_THAT(refused("name: pad" + gel(), "frame"), HasSubstr("'frame' can't be had of device pad: it has no camera"));
  EXPECT_THAT(refused(clear_device(), "height"), HasSubstr("'height' can't be had of device clear: it has no coating"));
  EXPECT_THAT(refused(milky_device(), "beads"), HasSubstr("'beads' can't be had of device milky: it has no beads"));
  EXPECT_THAT(refused(clear_device(), "markers"), HasSubstr("it has no printed coating and no pins"));
  EXPECT_THAT(refused(clear_device(), "events"), HasSubstr("it has no event pixels"));
  EXPECT_THAT(refused(clear_device(), "statistics"), HasSubstr("it has no motion chip"));
  EXPECT_THAT(refused(clear_device(), "frames"), HasSubstr("'frames'"));
}

}  // namespace
}  // namespace touchstone::datasets
