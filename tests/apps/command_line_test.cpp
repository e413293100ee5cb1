#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/whole_file.h"
#include "tests/apps/run_program.h"
#include "tests/support/small_job.h"

namespace touchstone {
namespace {

namespace fs = std::filesystem;
using test::expect_refused;
using test::ProgramRun;
using test::run_program;
using ::testing::AllOf;
using ::testing::HasSubstr;

class BadInput : public ::testing::Test {
 protected:
  BadInput() : job_(test::write_small_job(folder_)) {}

  /// Each command that reads the scene refuses it in the same words, and nothing new is in the folder.
  void expect_all_refuse(const std::string& where, const std::string& part) {
    const auto before = test::contents_of(folder_.path());
    const std::string scene = (folder_.path() / "scene.yaml").string();
    const std::vector<std::vector<std::string>> commands = {
        {"plan", scene},
        {"plan", job_.string()},
        {"render", scene, "-o", (folder_.path() / "picture.png").string()},
        {"generate", job_.string(), "-o", (folder_.path() / "new/out").string()}};
    for (const auto& command : commands) {
      const ProgramRun run = run_program(command);
      expect_refused(run, part);
      EXPECT_THAT(run.err, HasSubstr((folder_.path() / where).string() + ":"));
    }
    EXPECT_EQ(test::contents_of(folder_.path()), before);
    EXPECT_FALSE(fs::exists(folder_.path() / "new"));
  }

  void change(const std::string& file, const std::string& from, const std::string& to) {
    std::string text = read_whole_file(folder_.path() / file);
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    folder_.write(file, text.replace(at, from.size(), to));
  }

  test::TemporaryFolder folder_;
  fs::path job_;
};

TEST_F(BadInput, UnknownKeyNamesTheNearest) {
  change("device.yaml", "thickness_mm: 3", "thicknes_mm: 3");
  expect_all_refuse("device.yaml:2", "unknown key 'thicknes_mm' (did you mean 'thickness_mm'?)");
  test::write_small_job(folder_);
  change("object.yaml", "friction", "frictoin");
  expect_all_refuse("object.yaml:4", "did you mean 'friction'?");
}

TEST_F(BadInput, NegativeThickness) {
  change("device.yaml", "thickness_mm: 3", "thickness_mm: -3");
  expect_all_refuse("device.yaml:2", "gel.thickness_mm: -3 is not allowed");
}

TEST_F(BadInput, NotANumber) {
  change("motion.yaml", "1.7", ".nan");
  expect_all_refuse("motion.yaml:3", "isn't a finite number");
}

TEST_F(BadInput, DeviceWithoutCameraButAnImageAskedFor) {
  folder_.write("device.yaml", test::kSmallDevice);
  expect_all_refuse("scene.yaml", "has no camera");
}

TEST_F(BadInput, EventsOfACameraWithoutEventPixels) {
  change("scene.yaml", "radiance: true", "events: true");
  expect_refused(run_program({"plan", "--no-seconds", job_.string()}), "no block camera.events");
  const std::string scene = (folder_.path() / "scene.yaml").string();
  expect_refused(run_program({"render", scene, "--events", (folder_.path() / "e.h5").string()}),
                 "no block camera.events");
  expect_refused(run_program({"render", scene, "--events", (folder_.path() / "e.bin").string()}), ".aedat4");
  EXPECT_FALSE(fs::exists(folder_.path() / "e.h5"));
}

TEST_F(BadInput, NegativeEventThreshold) {
  change("device.yaml", "  read_noise_e: 5\n", "  events: {dark_e_per_s: 10, on_threshold: -0.1}\n");
  expect_all_refuse("device.yaml:20", "on_threshold");
}

TEST_F(BadInput, ExposureLongerThanAFrameOfTheMotion) {
  change("motion.yaml", "start_mm", "frame_rate_Hz: 5000\nstart_mm");
  expect_all_refuse("scene.yaml:1", "longer than a frame of the motion");
}

TEST_F(BadInput, RenderWritesTheEventsOfAScene) {
  change("device.yaml", "  read_noise_e: 5\n", "  events: {dark_e_per_s: 1000}\n");
  const std::string scene = (folder_.path() / "scene.yaml").string();
  const fs::path file = folder_.path() / "e.h5";
  const fs::path picture = folder_.path() / "e.png";
  const ProgramRun run =
      run_program({"render", scene, "--events", file.string(), "--events-picture", picture.string()});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("events from"));
  EXPECT_TRUE(fs::exists(file));
  EXPECT_TRUE(fs::exists(picture));
}

TEST_F(BadInput, ExportTurnsEventsIntoAnotherFormat) {
  const std::string in = folder_.write("in.txt", "0.5 3 4 1\n0.75 639 479 0\n").string();
  const auto at = [&](const char* name) { return (folder_.path() / name).string(); };
  EXPECT_EQ(run_program({"export", "events", in, "-o", at("e.raw")}).exit_code, 0);
  EXPECT_EQ(run_program({"export", "events", at("e.raw"), "-o", at("e.aedat4")}).exit_code, 0);
  EXPECT_EQ(run_program({"export", "events", at("e.aedat4"), "-o", at("e.h5")}).exit_code, 0);
  const ProgramRun run = run_program({"export", "events", at("e.h5"), "-o", at("e.csv")});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("2 events of 640 x 480 pixels"));
  EXPECT_THAT(read_whole_file(at("e.csv")), HasSubstr("\nt_us,x,y,p\n500000,3,4,1\n750000,639,479,0\n"));
  expect_refused(run_program({"export", "events", in, "-o", at("e.mp4")}), ".aedat4");
  expect_refused(run_program({"export", "events", in, "-o", in}), "written over");
  expect_refused(run_program({"export", "events", in, "-o", at("x.raw"), "--width", "640"}), "give both or none");
  expect_refused(run_program({"export", "events", in, "-o", at("x.raw"), "--width", "64", "--height", "48"}),
                 "columns 0 to 63");
  EXPECT_FALSE(fs::exists(at("x.raw")));
}

TEST_F(BadInput, MissingSceneFiles) {
  fs::remove(folder_.path() / "motion.yaml");
  expect_all_refuse("scene.yaml:3", "there is no file");
}

TEST_F(BadInput, BrokenYaml) {
  folder_.write("object.yaml", "name: [ball\n");
  expect_all_refuse("object.yaml", "isn't YAML");
}

/// Meshes are read where they're needed: not by `plan` of a scene.
class BadMesh : public BadInput {
 protected:
  void expect_refused_mesh(const std::string& part) {
    const auto before = test::contents_of(folder_.path());
    const ProgramRun run = run_program({"generate", job_.string(), "-o", (folder_.path() / "out").string()});
    expect_refused(run, part);
    EXPECT_THAT(run.err, HasSubstr("object.yaml:2"));
    EXPECT_EQ(test::contents_of(folder_.path()), before);
    EXPECT_FALSE(fs::exists(folder_.path() / "out"));
  }
};

TEST_F(BadMesh, Missing) {
  change("object.yaml", "{type: sphere, radius_mm: 2}", "{type: mesh, file: none.glb}");
  expect_refused_mesh("No such file");
}

/// A glTF file with its buffer beside it. Three numbers a vertex, three indices a triangle.
void write_gltf(const test::TemporaryFolder& folder, const std::vector<float>& vertices,
                const std::vector<std::uint16_t>& triangles) {
  const std::size_t position_bytes = vertices.size() * sizeof(float);
  const std::size_t index_bytes = triangles.size() * sizeof(std::uint16_t);
  std::string bytes(reinterpret_cast<const char*>(vertices.data()), position_bytes);
  bytes.append(reinterpret_cast<const char*>(triangles.data()), index_bytes);
  folder.write("mesh.bin", bytes);
  folder.write("mesh.gltf",
               fmt::format(R"({{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0]}}],
"nodes": [{{"mesh": 0}}], "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "indices": 1}}]}}],
"buffers": [{{"byteLength": {0}, "uri": "mesh.bin"}}],
"bufferViews": [{{"buffer": 0, "byteLength": {1}}}, {{"buffer": 0, "byteOffset": {1}, "byteLength": {2}}}],
"accessors": [{{"bufferView": 0, "componentType": 5126, "count": {3}, "type": "VEC3", "min": [0, 0, 0], "max": [2, 2, 2]}},
{{"bufferView": 1, "componentType": 5123, "count": {4}, "type": "SCALAR"}}]}})",
                           bytes.size(), position_bytes, index_bytes, vertices.size() / 3, triangles.size()));
}

const std::vector<float> kTetrahedron = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
const std::vector<std::uint16_t> kTetrahedronFaces = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};

TEST_F(BadMesh, Open) {
  write_gltf(folder_, kTetrahedron, {kTetrahedronFaces.begin(), kTetrahedronFaces.end() - 3});
  change("object.yaml", "{type: sphere, radius_mm: 2}", "{type: mesh, file: mesh.gltf, mm_per_unit: 1}");
  expect_refused_mesh("open");
}

TEST_F(BadMesh, SelfCrossing) {
  std::vector<float> vertices = kTetrahedron;
  std::vector<std::uint16_t> faces = kTetrahedronFaces;
  for (const float x : kTetrahedron) vertices.push_back(x + 0.1F);
  for (const std::uint16_t i : kTetrahedronFaces) faces.push_back(static_cast<std::uint16_t>(i + 4));
  write_gltf(folder_, vertices, faces);
  change("object.yaml", "{type: sphere, radius_mm: 2}", "{type: mesh, file: mesh.gltf, mm_per_unit: 1}");
  expect_refused_mesh("cross");
}

TEST_F(BadMesh, AGoodOneIsTaken) {
  write_gltf(folder_, kTetrahedron, kTetrahedronFaces);
  change("object.yaml", "{type: sphere, radius_mm: 2}", "{type: mesh, file: mesh.gltf, mm_per_unit: 1}");
  const ProgramRun run = run_program({"plan", "--no-seconds", job_.string()});
  EXPECT_EQ(run.exit_code, 0) << run.err;
}

TEST(CommandLine, HelpOfEachCommand) {
  for (const std::string command : {"plan", "render", "generate", "calibrate", "estimate", "validate", "inspect"}) {
    const ProgramRun run = run_program({command, "--help"});
    EXPECT_EQ(run.exit_code, 0) << command;
    EXPECT_THAT(run.out, HasSubstr("Usage: touchstone " + command));
    EXPECT_EQ(run.err, "");
  }
  EXPECT_THAT(run_program({"--help"}).out, HasSubstr("Subcommands:"));
  EXPECT_THAT(run_program({"--version"}).out, ::testing::StartsWith("touchstone "));
}

TEST(CommandLine, MistakesOnTheLineItself) {
  expect_refused(run_program({"generat"}), "did you mean 'generate'?");
  expect_refused(run_program({}), "subcommand");
  expect_refused(run_program({"generate"}), "JOB");
  expect_refused(run_program({"plan", "a.yaml", "--thread", "2"}), "--thread");
  expect_refused(run_program({"--threads", "0", "plan", "a.yaml"}), "--threads");
  expect_refused(run_program({"plan", "/nonexistent.yaml"}), "/nonexistent.yaml");
  expect_refused(run_program({"validate", "mecanics"}), "mecanics");
  expect_refused(run_program({"calibrate", "vhx", "--frames", ".", "-o", "m.json"}), "did you mean 'vhs'?");
  expect_refused(run_program({"calibrate", "vhs", "-o", "m.json"}), "--frames");
  expect_refused(run_program({"estimate", "vhs", "--model", "/none.json", "--frames", "."}), "/none.json");
  expect_refused(run_program({"estimate", "vhs", "--model", "m.json", "--frames", ".", "--compliance", "c"}),
                 "--distribution");
  expect_refused(run_program({"inspect", "/nonexistent", "-o", "sheet.png"}), "isn't a data set");
}

TEST_F(BadInput, ResultsThatCantBeWrittenAreRefusedBeforeTheWork) {
  const std::string scene = (folder_.path() / "scene.yaml").string();
  expect_refused(run_program({"render", scene, "-o", "/nonexistent/a.png"}), "there is no folder");
  expect_refused(run_program({"render", scene, "-o", "a.jpg"}), ".png");
  expect_refused(run_program({"render", scene, "-o", (folder_.path() / "a.png").string(), "--frame", "99"}),
                 "frames 0 to 5");
  expect_refused(run_program({"generate", job_.string(), "-o", scene}), "isn't a folder");
  expect_refused(run_program({"validate", "light", "--page", "/nonexistent/a.html"}), "there is no folder");
  expect_refused(run_program({"validate", "light", "--page", "a.pdf"}), ".html");
  expect_refused(run_program({"validate", "light", "-o", scene}), "scene.yaml");
  expect_refused(run_program({"validate", "light", "--date", "today"}), "--page");
  expect_refused(run_program({"generate", job_.string(), "-o", folder_.path().string()}), "isn't empty");
}

TEST_F(BadInput, ExportsOfWhatTheDeviceHasntAreRefusedBeforeTheWork) {
  const std::string device = (folder_.path() / "device.yaml").string();
  const std::string out = (folder_.path() / "map.bin").string();
  expect_refused(run_program({"export"}), "subcommand");
  expect_refused(run_program({"export", "complianc"}), "did you mean 'compliance'?");
  expect_refused(run_program({"export", "compliance", "--device", device}), "--out");
  expect_refused(run_program({"export", "compliance", "--device", device, "-o", "/nonexistent/a.bin"}),
                 "there is no folder");
  expect_refused(run_program({"export", "compliance", "--device", "/nonexistent.yaml", "-o", out}),
                 "/nonexistent.yaml");
  const auto refuse_patch = [&](const std::string& side, const std::string& part) {
    expect_refused(run_program({"--quiet", "--cache", folder_.path().string(), "export", "compliance", "--device",
                                device, "-o", out, "--patch-mm", side}),
                   part);
  };
  refuse_patch("wide", "--patch-mm");
  refuse_patch("0", "side is 0 mm");
  refuse_patch("100", "100 mm");
  EXPECT_FALSE(fs::exists(out));
  const ProgramRun run = run_program(
      {"--quiet", "--cache", folder_.path().string(), "export", "compliance", "--device", device, "-o", out});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("markers under tractions on"));
  EXPECT_TRUE(fs::exists(out));
  change("device.yaml", "beads:", "# beads:");
  expect_refused(run_program({"export", "compliance", "--device", device, "-o", out}),
                 "neither printed markers nor beads");
}

TEST_F(BadInput, RecordingsOfWrongGraspsAreRefusedBeforeTheWork) {
  const std::string out = (folder_.path() / "recording").string();
  expect_refused(run_program({"record"}), "subcommand");
  expect_refused(run_program({"record", "dsv"}), "did you mean 'dvs'?");
  expect_refused(run_program({"record", "dvs"}), "--out");
  expect_refused(run_program({"record", "dvs", "-o", folder_.path().string()}), "is there already");
  expect_refused(run_program({"record", "dvs", "-o", "/nonexistent/a"}), "there is no folder");
  expect_refused(run_program({"record", "dvs", "-o", out, "--grasps", "49"}), "allowed is 1 to 48");
  expect_refused(run_program({"record", "dvs", "-o", out, "--grasps", "-1"}), "--grasps is -1");
  EXPECT_FALSE(fs::exists(out));
}

TEST_F(BadInput, PlanShowsReasons) {
  const ProgramRun run = run_program({"plan", "--no-seconds", job_.string()});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("2 scenes, 12 samples"), HasSubstr("friction"), HasSubstr("refraction")));
}

}  // namespace
}  // namespace touchstone
