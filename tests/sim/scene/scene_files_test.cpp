#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/whole_file.h"
#include "sim/scene/device_gel.h"
#include "sim/scene/scene.h"
#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sim {
namespace {

using test::message_of;
using ::testing::HasSubstr;

const std::filesystem::path kScenes = std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes";

const char* const kDevice = R"(name: small
gel:
  size_x_mm: 10
  size_y_mm: 10
  thickness_mm: 4
  youngs_modulus_MPa: 0.3
plate: {thickness_mm: 1, refractive_index: 1.5}
)";

/// The message that reading a device text ends with, or the empty string.
std::string error_of_device(const std::string& text) {
  try {
    parse_yaml<DeviceSpec>(text, "device.yaml");
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

std::string error_of_object(const std::string& text) {
  try {
    parse_yaml<ObjectSpec>(text, "object.yaml");
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const auto at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), by);
}

TEST(SceneFiles, EveryShippedSceneReads) {
  int scenes = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(kScenes / "vhs")) {
    if (entry.path().extension() != ".yaml") continue;
    EXPECT_NO_THROW(read_scene(entry.path())) << entry.path();
    ++scenes;
  }
  EXPECT_GE(scenes, 3);
}

TEST(SceneFiles, EveryShippedObjectReadsAndHasASolidMesh) {
  for (const auto& entry : std::filesystem::directory_iterator(kScenes / "objects")) {
    if (entry.path().extension() != ".yaml") continue;
    EXPECT_EQ(fault_of_closed_mesh(visible_mesh(read_object(entry.path()).shape)), "") << entry.path();
  }
}

TEST(SceneFiles, TheSmallDeviceReads) {
  const auto device = parse_yaml<DeviceSpec>(kDevice, "device.yaml");
  EXPECT_EQ(device.gel.thickness_mm, 4.0);
  EXPECT_EQ(device.gel.poisson_ratio, 0.49) << "the default";
  EXPECT_FALSE(device.camera);
}

TEST(SceneFiles, AnUnknownKeyNamesItsLineAndTheNearestOne) {
  EXPECT_EQ(error_of_device(replaced(kDevice, "thickness_mm: 4", "thicknes_mm: 4")),
            "device.yaml:5: gel: unknown key 'thicknes_mm' (did you mean 'thickness_mm'?)");
  EXPECT_EQ(error_of_device(replaced(kDevice, "  thickness_mm: 4\n", "  thickness_mm: 4\n  poison_ratio: 0.4\n")),
            "device.yaml:6: gel: unknown key 'poison_ratio' (did you mean 'poisson_ratio'?)");
}

TEST(SceneFiles, ANegativeThicknessSaysWhatIsAllowed) {
  EXPECT_EQ(error_of_device(replaced(kDevice, "thickness_mm: 4", "thickness_mm: -4")),
            "device.yaml:5: gel.thickness_mm: -4 is not allowed; allowed is above 0 to 1000");
  EXPECT_THAT(error_of_device(replaced(kDevice, "thickness_mm: 4", "thickness_mm: 0")), HasSubstr("0 is not allowed"));
}

TEST(SceneFiles, NanAndInfinityAreRefused) {
  for (const char* value : {".nan", "nan", ".inf", "-.inf", "1e999", "4mm", "''"}) {
    EXPECT_THAT(error_of_device(replaced(kDevice, "thickness_mm: 4", std::string("thickness_mm: ") + value)),
                HasSubstr("device.yaml:5: gel.thickness_mm: "))
        << value;
  }
}

TEST(SceneFiles, PoissonsRatioMayBeAHalfAndNotMore) {
  EXPECT_EQ(error_of_device(replaced(kDevice, "  thickness", "  poisson_ratio: 0.5\n  thickness")), "");
  EXPECT_THAT(error_of_device(replaced(kDevice, "  thickness", "  poisson_ratio: 0.51\n  thickness")),
              HasSubstr("from 0 to 0.5"));
}

TEST(SceneFiles, AGelMayRelaxButSomethingMustLast) {
  const auto with = [](const std::string& terms) {
    return replaced(kDevice, "  thickness", "  relaxation: [" + terms + "]\n  thickness");
  };
  const auto device = parse_yaml<DeviceSpec>(with("{share: 0.2, time_s: 0.1}, {share: 0.3, time_s: 4}"), "device.yaml");
  const fem::PronySeries series = prony_series(device.gel);
  ASSERT_EQ(series.size(), 2u);
  EXPECT_EQ(series[1].share, 0.3);
  EXPECT_EQ(series[1].time, 4.0);
  EXPECT_THAT(error_of_device(with("{share: 0.5, time_s: 1}, {share: 0.5, time_s: 2}")),
              HasSubstr("device.yaml:5: relaxation: the shares sum to 1; something must last"));
  EXPECT_THAT(error_of_device(with("{share: -0.1, time_s: 1}")), HasSubstr("-0.1 is not allowed"));
  EXPECT_THAT(error_of_device(with("{share: 0.1, time_s: 0}")), HasSubstr("0 is not allowed"));
  EXPECT_THAT(error_of_device(with("{share: 0.1}")), HasSubstr("time_s"));
}

TEST(SceneFiles, TheGelsDensityIsThatOfWaterUnlessSaid) {
  EXPECT_EQ(parse_yaml<DeviceSpec>(kDevice, "d").gel.density_kg_m3, 1000.0);
  EXPECT_THAT(error_of_device(replaced(kDevice, "  thickness", "  density_kg_m3: 0\n  thickness")),
              HasSubstr("0 is not allowed"));
}

TEST(SceneFiles, AVibrationNeedsAPositionAndAFrequency) {
  const std::string start = "start_mm: [0, 0, 1]\nkeys:\n  - {frames: 2, ";
  const auto motion =
      parse_yaml<MotionSpec>(start + "vibration: {axis: y, amplitude_mm: 0.1, frequency_Hz: 30}}\n", "m");
  EXPECT_EQ(motion.keys[0].vibration->axis, Axis::y);
  EXPECT_EQ(motion.highest_vibration_Hz(), 30.0);
  EXPECT_TRUE(motion.is_tangential());
  const auto error = [&](const std::string& rest) {
    return message_of([&] { parse_yaml<MotionSpec>(start + rest + "}\n", "m"); });
  };
  EXPECT_THAT(error("vibration: {axis: w, amplitude_mm: 0.1, frequency_Hz: 30}"), HasSubstr("axis"));
  EXPECT_THAT(error("vibration: {axis: z, amplitude_mm: -0.1, frequency_Hz: 30}"), HasSubstr("-0.1 is not allowed"));
  EXPECT_THAT(error("vibration: {axis: z, amplitude_mm: 0.1, frequency_Hz: 0}"), HasSubstr("0 is not allowed"));
  EXPECT_THAT(error("vibration: {axis: z, amplitude_mm: 0.1}"), HasSubstr("frequency_Hz"));
  EXPECT_THAT(error("z: {force_N: 1}, vibration: {axis: z, amplitude_mm: 0.1, frequency_Hz: 30}"),
              HasSubstr("needs a position"));
  EXPECT_EQ(error("z: {position_mm: 1}, vibration: {axis: z, amplitude_mm: 0.1, frequency_Hz: 30}"), "no error");
}

TEST(SceneFiles, ARotationIsLedByAnglesOrByTorques) {
  const std::string start = "start_mm: [0, 0, 1]\nkeys:\n  - {frames: 2, ";
  const auto motion = parse_yaml<MotionSpec>(start + "turn_y: {torque_Nmm: -2}}\n", "m");
  ASSERT_TRUE(motion.keys[0].turn_y);
  EXPECT_EQ(motion.keys[0].turn_y->torque_Nmm, -2.0);
  EXPECT_FALSE(motion.keys[0].turn_x);
  EXPECT_TRUE(motion.is_turned());
  EXPECT_TRUE(motion.is_tangential()) << "a tilt calls for friction";
  EXPECT_FALSE(parse_yaml<MotionSpec>(start + "z: {force_N: 1}}\n", "m").is_turned());
  const auto error = [&](const std::string& rest) {
    return message_of([&] { parse_yaml<MotionSpec>(start + rest + "}\n", "m"); });
  };
  EXPECT_THAT(error("angles_deg: [0, 0, 0], turn_x: {torque_Nmm: 0}"), HasSubstr("m:3: "));
  EXPECT_THAT(error("angles_deg: [0, 0, 0], turn_x: {torque_Nmm: 0}"),
              HasSubstr("angles_deg: can't stand beside turn_x"));
  EXPECT_THAT(error("turn_x: {force_N: 0}"), HasSubstr("torque_Nmm"));
  EXPECT_THAT(error("turn_x: {torque_Nmm: .nan}"), HasSubstr("torque_Nmm"));
}

const char* const kDome = R"(name: dome
gel:
  shape: dome
  sphere_radius_mm: 20
  base_radius_mm: 8
  youngs_modulus_MPa: 0.3
plate: {thickness_mm: 1, refractive_index: 1.5}
)";

const char* const kFingertip = R"(name: tip
gel:
  shape: fingertip
  radius_mm: 8
  length_mm: 8
  sleeve_mm: 6
  youngs_modulus_MPa: 0.3
  layers:
    - {name: skin, thickness_mm: 0.3, youngs_modulus_MPa: 1.2, poisson_ratio: 0.48}
plate: {thickness_mm: 1, refractive_index: 1.5}
)";

TEST(SceneFiles, ADomeReadsAndItsThicknessIsWorkedOut) {
  const auto device = parse_yaml<DeviceSpec>(kDome, "device.yaml");
  EXPECT_NE(device.gel.dome(), nullptr);
  EXPECT_NEAR(device.gel.thickness_mm, 20.0 - std::sqrt(336.0), 1e-12);
  const auto body = std::get<fem::DomeGel>(gel_body(device));
  EXPECT_EQ(body.sphere_radius, 20.0);
  EXPECT_EQ(body.fine_radius, 5.0) << "the larger of the mesh's half extents";
  EXPECT_NO_THROW(fem::mesh_gel(body));
  EXPECT_EQ(
      parse_yaml<DeviceSpec>(replaced(kDome, "radius_mm: 8", "radius_mm: 8\n  thickness_mm: 5"), "d").gel.thickness_mm,
      5.0);
}

TEST(SceneFiles, AFingertipWithASkinReads) {
  const auto device = parse_yaml<DeviceSpec>(kFingertip, "device.yaml");
  EXPECT_EQ(device.gel.thickness_mm, 16.0);
  ASSERT_EQ(device.gel.layers.size(), 1u);
  EXPECT_EQ(device.gel.layers[0].name, "skin");
  const auto body = std::get<fem::FingertipGel>(gel_body(device));
  EXPECT_EQ(body.layers, std::vector<double>{0.3});
  const auto materials = gel_materials(device.gel);
  ASSERT_EQ(materials.size(), 2u);
  EXPECT_EQ(materials[0].youngs_modulus, 0.3) << "the body comes first";
  EXPECT_EQ(materials[1].youngs_modulus, 1.2);
  EXPECT_EQ(materials[1].poisson_ratio, 0.48);
}

TEST(SceneFiles, ASlabTakesLayersAndIsASlabWithoutBeingAsked) {
  const std::string layered = replaced(
      kDevice, "  thickness_mm: 4\n",
      "  thickness_mm: 4\n  layers:\n    - {thickness_mm: 0.2, youngs_modulus_MPa: 0.4, poisson_ratio: 0.5}\n");
  const auto device = parse_yaml<DeviceSpec>(layered, "device.yaml");
  EXPECT_NE(device.gel.slab(), nullptr);
  EXPECT_EQ(std::get<fem::SlabGel>(gel_body(device)).layers, std::vector<double>{0.2});
  EXPECT_THAT(error_of_device(replaced(layered, "0.2,", "4,")), HasSubstr("device.yaml:3: gel: the slab's layers are"));
  EXPECT_THAT(error_of_device(replaced(layered, "0.2,", "0,")), HasSubstr("thickness_mm: 0 is not allowed"));
}

TEST(SceneFiles, AGelTakesOnlyItsOwnFieldsAndShapesThatCanBe) {
  EXPECT_THAT(error_of_device(replaced(kDome, "base_radius_mm: 8", "base_radius_mm: 8\n  sleeve_mm: 2")),
              HasSubstr("unknown key 'sleeve_mm'"));
  EXPECT_THAT(error_of_device(replaced(kDome, "shape: dome", "shape: dom")), HasSubstr("did you mean 'dome'"));
  EXPECT_THAT(error_of_device(replaced(kDome, "base_radius_mm: 8", "base_radius_mm: 28")),
              HasSubstr("device.yaml:3: gel: the dome's base radius is 28 mm; it must not be above"));
  EXPECT_THAT(error_of_device(replaced(kFingertip, "sleeve_mm: 6", "sleeve_mm: 9")),
              HasSubstr("must not be longer than its cylinder"));
}

TEST(SceneFiles, AForceErrorMayStandInPlaceOfAMesh) {
  const auto with_mesh = [](const std::string& mesh) { return kDevice + ("mesh: " + mesh + "\n"); };
  const auto device = parse_yaml<DeviceSpec>(with_mesh("{force_error: 0.01, contact_radius_mm: 1}"), "device.yaml");
  EXPECT_EQ(device.mesh.force_error, 0.01);
  EXPECT_EQ(device.mesh.contact_radius_mm, 1.0);
  EXPECT_FALSE(device.mesh.sharp_bodies);
  EXPECT_THAT(error_of_device(with_mesh("{force_error: 0.01, contact_radius_mm: 1, fine_mm: 0.5}")),
              HasSubstr("fine_mm: can't stand beside force_error"));
  EXPECT_THAT(error_of_device(with_mesh("{force_error: 0.01}")), HasSubstr("contact_radius_mm"));
  EXPECT_THAT(error_of_device(with_mesh("{force_error: 0, contact_radius_mm: 1}")), HasSubstr("force_error"));
  EXPECT_THAT(error_of_device(with_mesh("{force_error: 0.01, contact_radius_mm: 7}")), HasSubstr("contact_radius_mm"));
  EXPECT_THAT(error_of_device(with_mesh("{fine_mm: 0.5, contact_radius_mm: 1}")), HasSubstr("contact_radius_mm"));
}

TEST(SceneFiles, ClearSidesAreForCoatedGels) {
  const std::string clear = replaced(kDevice, "  thickness_mm: 4\n", "  thickness_mm: 4\n  frame: clear\n");
  const std::string coating = "coating: {type: matt, albedo: 0.5}\n";
  EXPECT_EQ(parse_yaml<DeviceSpec>(clear + coating, "device.yaml").gel.frame, GelFrame::clear);
  EXPECT_THAT(error_of_device(clear), HasSubstr("device.yaml:3: gel.frame: clear is for coated gels"));
  EXPECT_THAT(error_of_device(replaced(clear, "clear\n", "clear\n  frame_albedo: 0.5\n") + coating),
              HasSubstr("unknown key 'frame_albedo'"));
}

TEST(SceneFiles, BeadsMustLieInTheGel) {
  const std::string beads = "beads: {grid: 3, spacing_mm: 2, diameter_mm: 0.5, depth_mm: 0.2}\n";
  EXPECT_THAT(error_of_device(kDevice + beads), HasSubstr("beads.depth_mm: 0.2 puts beads"));
  EXPECT_THAT(error_of_device(kDevice + replaced(beads, "spacing_mm: 2", "spacing_mm: 6")), HasSubstr("depth"));
  EXPECT_THAT(error_of_device(kDevice + replaced(replaced(beads, "0.2", "1"), "spacing_mm: 2", "spacing_mm: 6")),
              HasSubstr("doesn't fit"));
}

TEST(SceneFiles, AShapeTakesOnlyItsOwnFields) {
  EXPECT_EQ(error_of_object("name: a\nshape: {type: sphere, radius_mm: 2}\n"), "");
  EXPECT_THAT(error_of_object("name: a\nshape: {type: sphere, radius_mm: 2, height_mm: 3}\n"),
              HasSubstr("unknown key 'height_mm'"));
  EXPECT_THAT(error_of_object("name: a\nshape: {type: spere, radius_mm: 2}\n"), HasSubstr("did you mean 'sphere'"));
  EXPECT_THAT(error_of_object("name: a\nshape: {type: rounded_cylinder, radius_mm: 2, height_mm: 3, "
                              "edge_radius_mm: 2.5}\n"),
              HasSubstr("from 0 to 2"));
}

TEST(SceneFiles, AMissingFileIsNamedWithTheLineThatAsksForIt) {
  test::TemporaryFolder folder;
  folder.write("device.yaml", kDevice);
  const auto scene = folder.write("scene.yaml", "device: device.yaml\nobject: nowhere.yaml\nmotion: m.yaml\n");
  try {
    read_scene(scene);
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.where().line, 2);
    EXPECT_THAT(error.what(), HasSubstr("nowhere.yaml"));
  }
}

TEST(SceneFiles, AMissingMeshIsNamedWithTheLineThatAsksForIt) {
  try {
    parse_yaml<ObjectSpec>("name: a\nshape:\n  type: mesh\n  file: nowhere.glb\n", "/tmp/none/object.yaml");
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.where().line, 4);
    EXPECT_THAT(error.what(), HasSubstr("nowhere.glb"));
  }
}

TEST(SceneFiles, AHexagonHasItsOwnFields) {
  const auto shape =
      parse_yaml<ObjectSpec>("name: a\nshape: {type: hexagon, across_flats_mm: 6.5, length_mm: 35.5}\n", "object.yaml")
          .shape;
  EXPECT_EQ(shape.across_flats_mm, 6.5);
  EXPECT_EQ(shape.length_mm, 35.5);
  for (const char* wrong :
       {"{type: hexagon, across_flats_mm: 6.5}", "{type: hexagon, across_flats_mm: 0, length_mm: 1}",
        "{type: hexagon, across_flats_mm: 1, length_mm: 1, radius_mm: 1}"}) {
    EXPECT_THROW(parse_yaml<ObjectSpec>("name: a\nshape: " + std::string(wrong) + "\n", "object.yaml"), Error) << wrong;
  }
}

TEST(SceneFiles, AMeshFilesUnitIsThatOfItsKindUnlessGiven) {
  const std::string boxes = std::string(TOUCHSTONE_SOURCE_DIR) + "/tests/fuzz/corpus/plain_mesh/object.yaml";
  const auto longest = [&](const std::string& fields) {
    double z = 0.0;
    const auto shape = parse_yaml<ObjectSpec>("name: a\nshape: {type: mesh, " + fields + "}\n", boxes).shape;
    for (const Eigen::Vector3d& vertex : visible_mesh(shape).vertices) z = std::max(z, vertex.z());
    return z;
  };
  EXPECT_EQ(longest("file: meshio-binary.stl"), 5.0);
  EXPECT_EQ(longest("file: meshio-quads.obj"), 5.0);
  EXPECT_EQ(longest("file: meshio-text.ply, mm_per_unit: 25.4"), 127.0);
  try {
    longest("\n  file: ../gltf");
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("object.yaml:3"));
    EXPECT_THAT(error.what(), HasSubstr("known are .glb, .gltf, .stl, .obj and .ply"));
  }
}

TEST(SceneFiles, ShapesHaveTheirOwnFieldsAndRanges) {
  const auto read = [](const std::string& shape) {
    return parse_yaml<ObjectSpec>("name: a\nshape: {type: " + shape + "}\n", "object.yaml");
  };
  for (const char* right :
       {"cone, half_angle_deg: 30, height_mm: 5", "cone, half_angle_deg: 30, height_mm: 5, tip_radius_mm: 9.99",
        "torus, radius_mm: 3, tube_radius_mm: 2.9", "capsule, radius_mm: 1, length_mm: 2",
        "lying_cylinder, radius_mm: 1, length_mm: 0.5", "wedge, half_angle_deg: 45, height_mm: 2, length_mm: 9"}) {
    EXPECT_NO_THROW(fem::check_shape(contact_shape(read(right)))) << right;
  }
  for (const char* wrong :
       {"cone, half_angle_deg: 30", "cone, half_angle_deg: 90, height_mm: 5", "cone, half_angle_deg: 0, height_mm: 5",
        "cone, half_angle_deg: 30, height_mm: 5, tip_radius_mm: 10.01",
        "cone, half_angle_deg: 30, height_mm: 5, tip_radius_mm: -1", "torus, radius_mm: 3, tube_radius_mm: 3",
        "torus, radius_mm: 3, tube_radius_mm: 0", "capsule, radius_mm: 1, length_mm: 1.9",
        "lying_cylinder, radius_mm: 1, length_mm: 0", "wedge, half_angle_deg: 91, height_mm: 2, length_mm: 9",
        "capsule, radius_mm: 1, length_mm: 4, height_mm: 1"}) {
    EXPECT_THROW(read(wrong), Error) << wrong;
  }
}

TEST(SceneFiles, AnAxisHasEitherAPositionOrAForce) {
  const std::string start = "start_mm: [0, 0, 1]\nkeys:\n  - {frames: 2, z: ";
  EXPECT_EQ(parse_yaml<MotionSpec>(start + "{force_N: 1}}\n", "m").frame_count(), 3);
  EXPECT_THROW(parse_yaml<MotionSpec>(start + "{force_N: 1, position_mm: 2}}\n", "m"), Error);
  EXPECT_THROW(parse_yaml<MotionSpec>(start + "{}}\n", "m"), Error);
}

TEST(SceneFiles, AMotionHasAsManyFramesAsAnIntCounts) {
  std::string text = "start_mm: [0, 0, 1]\nkeys:\n";
  for (int key = 0; key < 99; ++key) text += "  - {frames: 10000000}\n";
  EXPECT_EQ(parse_yaml<MotionSpec>(text, "m").frame_count(), 990'000'001);
  EXPECT_THROW(parse_yaml<MotionSpec>(text + "  - {frames: 10000000}\n", "m"), Error);
}

}  // namespace
}  // namespace touchstone::sim
