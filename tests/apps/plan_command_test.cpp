// `touchstone plan` as a user runs it: every shipped file that says what will be simulated has a plan, every other one
// is refused with the reason.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "core/whole_file.h"
#include "tests/apps/run_program.h"
#include "tests/support/small_draw.h"
#include "tests/support/small_job.h"
#include "tests/support/temporary_folder.h"

namespace touchstone {
namespace {

namespace fs = std::filesystem;
using test::ProgramRun;
using test::run_program;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

const fs::path kScenes = fs::path(TOUCHSTONE_SOURCE_DIR) / "scenes";

std::vector<fs::path> yaml_files_in(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".yaml") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

TEST(PlanCommand, PlansEachShippedFileThatSaysWhatWillBeSimulated) {
  const fs::path device_beside_studies = kScenes / "studies" / "chroma-gel.yaml";
  int planned = 0;
  for (const char* folder : {"jobs", "studies", "chroma", "gelsight", "vhs"}) {
    for (const fs::path& file : yaml_files_in(kScenes / folder)) {
      if (file == device_beside_studies) continue;
      const ProgramRun run = run_program({"--quiet", "plan", "--no-seconds", file.string()});
      EXPECT_EQ(run.exit_code, 0) << file << ": " << run.err;
      EXPECT_EQ(run.err, "") << file;
      EXPECT_THAT(run.out, AllOf(HasSubstr("gel mechanics"), HasSubstr("camera and renderer"), HasSubstr("gel: ")))
          << file;
      ++planned;
    }
  }
  EXPECT_EQ(planned, 9 + 4 + 1 + 10 + 8);
}

TEST(PlanCommand, SaysWhyItRefusesEachOtherShippedFile) {
  const std::map<std::string, std::string> reasons = {
      {"devices", "it is a device's file and doesn't say what presses it"},
      {"objects", "it is an object's file and doesn't say what it is pressed on"},
      {"motions", "it is a motion's file and doesn't say what is moved"},
      {"palpation", "it is a palpation's file; `touchstone validate vhs.palpation`"},
  };
  const auto expect_reason = [](const fs::path& file, const std::string& reason) {
    const ProgramRun run = run_program({"plan", file.string()});
    test::expect_refused(run, reason);
    EXPECT_THAT(run.err, AllOf(HasSubstr(file.string() + ": "), HasSubstr("takes scenes, jobs of scenes, jobs that "
                                                                          "draw, and studies")));
  };
  for (const auto& [folder, reason] : reasons) {
    const std::vector<fs::path> files = yaml_files_in(kScenes / folder);
    EXPECT_FALSE(files.empty()) << folder;
    for (const fs::path& file : files) expect_reason(file, reason);
  }
  expect_reason(kScenes / "studies" / "chroma-gel.yaml", reasons.at("devices"));
  test::TemporaryFolder folder;
  expect_reason(folder.write("fit.yaml", "name: f\ndevice: d.yaml\nunknowns: []\npresses: []\n"),
                "it is a fit's file; `touchstone fit`");
}

TEST(PlanCommand, PrintsSecondsOfThisMachine) {
  const test::TemporaryFolder folder;
  test::write_small_job(folder);
  const std::string scene = (folder.path() / "scene.yaml").string();
  const std::vector<std::string> words = {"--quiet", "--threads", "1", "--cache", (folder.path() / "cache").string()};
  const auto plan = [&](const std::vector<std::string>& more) {
    std::vector<std::string> all = words;
    all.insert(all.end(), more.begin(), more.end());
    return run_program(all);
  };
  const ProgramRun first = plan({"plan", scene});
  ASSERT_EQ(first.exit_code, 0) << first.err;
  EXPECT_THAT(first.out, AllOf(HasSubstr("a frame  why (cost)"), HasSubstr("\non 1 thread of this machine: about "),
                               HasSubstr(" set-up, "), HasSubstr(" frames at "),
                               HasSubstr("not known: what is pressed: the gel isn't set up yet")));
  const auto rates = [&] {
    int count = 0;
    for (const auto& entry : fs::directory_iterator(folder.path() / "cache")) {
      count += entry.path().filename().string().starts_with("rates-");
    }
    return count;
  };
  EXPECT_EQ(rates(), 1);
  const ProgramRun none = plan({"plan", "--no-seconds", scene});
  EXPECT_THAT(none.out, AllOf(HasSubstr("on   why (cost)"), Not(HasSubstr("of this machine"))));
  const ProgramRun job = plan({"plan", (folder.path() / "job.yaml").string()});
  EXPECT_THAT(job.out, HasSubstr(" of this machine: about "));
  EXPECT_EQ(rates(), 1) << "measured once";
}

TEST(PlanCommand, OfAJobThatDrawsPlansEachObject) {
  const test::TemporaryFolder folder;
  const fs::path job = test::write_small_draw(folder);
  const ProgramRun run = run_program({"plan", "--no-seconds", job.string()});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("job small-draw: draws 10 samples; units: 2, objects: 2, files: 4\n"));
  EXPECT_THAT(run.out, AllOf(HasSubstr("\nball (sample "), HasSubstr("\npunch (sample ")));
  // The virtual sensor's own switches, and the job's outputs: height and contact are of each pixel's first hit.
  EXPECT_THAT(run.out, AllOf(HasSubstr("direct light            yes  the scene switches it on"),
                             HasSubstr("motion blur             no   the scene switches it off"),
                             HasSubstr("truth of pixels         yes")));
  std::string text = read_whole_file(job);
  text.replace(text.find("outputs: [frame, height, contact]"), 33, "outputs: []");
  const ProgramRun unseen = run_program({"plan", "--no-seconds", folder.write("unseen.yaml", text).string()});
  ASSERT_EQ(unseen.exit_code, 0) << unseen.err;
  EXPECT_THAT(unseen.out, HasSubstr("no image is asked for: truth alone needs none"));
}

TEST(PlanCommand, OfAJobThatDrawsTakesDevicesWithoutACameraAndMilkyOnes) {
  const test::TemporaryFolder folder;
  std::string text = read_whole_file(test::write_small_draw(folder));
  const auto put = [&](const std::string& from, const std::string& to) {
    ASSERT_NE(text.find(from), std::string::npos) << from;
    text.replace(text.find(from), from.size(), to);
  };
  std::string blind = test::kDrawDevice;
  blind.erase(blind.find("lamps:"));
  folder.write("blind.yaml", blind);
  put("device: device.yaml", "device: blind.yaml");
  put("      - {path: 'lamps[*].power_W', times: {uniform: [0.9, 1.1]}}\n", "");
  put("outputs: [frame, height, contact]", "outputs: [traction]");
  const ProgramRun run = run_program({"plan", "--no-seconds", folder.write("blind-job.yaml", text).string()});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("no image is asked for: truth alone needs none"));
  EXPECT_THAT(run.out, Not(HasSubstr("milky")));
  put("device: blind.yaml", "device: " + (kScenes / "devices" / "dvs-grasp.yaml").string());
  put("outputs: [traction]", "outputs: [frame, events]");
  const ProgramRun milky = run_program({"plan", "--no-seconds", folder.write("milky-job.yaml", text).string()});
  ASSERT_EQ(milky.exit_code, 0) << milky.err;
  EXPECT_THAT(milky.out, HasSubstr("Pictures are made from maps of what touches the milky gel"));
}

TEST(PlanCommand, RefusesAMistakeInAJobThatDrawsWithItsLine) {
  const test::TemporaryFolder folder;
  std::string text = test::kSmallDraw;
  text.replace(text.find("tilt_deg"), 8, "tild_deg");
  test::expect_refused(run_program({"plan", test::write_small_draw(folder, text).string()}),
                       "job.yaml:18: draw: unknown key 'tild_deg'");
}

TEST(PlanCommand, OfAStudyPlansWhatEachDesignIsPutThrough) {
  const ProgramRun beads = run_program({"plan", (kScenes / "studies" / "vhs-thickness-spacing.yaml").string()});
  EXPECT_THAT(beads.out, AllOf(HasSubstr("study vhs-thickness-spacing: 64 designs\n"),
                               HasSubstr("pressed with up to 5 N, pictured and tracked\n"),
                               HasSubstr("the training's load cycle, without pictures\n"),
                               HasSubstr("an image or a stream of events is asked for"),
                               HasSubstr("no image is asked for: truth alone needs none")));
  // By linear elasticity, and then at finite strain.
  const ProgramRun presses = run_program({"plan", (kScenes / "studies" / "chroma-thickness.yaml").string()});
  EXPECT_THAT(presses.out,
              AllOf(HasSubstr("14 designs"), HasSubstr("with up to 1 N, linear\n"),
                    HasSubstr("with up to 1 N, finite\n"), HasSubstr("the scene asks for neo-Hookean elasticity")));
  EXPECT_EQ(count_of(presses.out, "linear elasticity is the default"), 1u);
}

TEST(PlanCommand, SaysThatAStudyByFormulaSimulatesNothing) {
  const test::TemporaryFolder folder;
  std::string text = read_whole_file(kScenes / "studies" / "chroma-thickness.yaml");
  const auto put = [&](const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
  };
  put("device: chroma-gel.yaml", "device: " + (kScenes / "studies" / "chroma-gel.yaml").string());
  put("../objects/ball-4mm.yaml", (kScenes / "objects" / "ball-4mm.yaml").string());
  put("by: [formula, linear, finite]", "by: [formula]");
  const std::string file = folder.write("formula.yaml", text).string();
  const ProgramRun run = run_program({"plan", file});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.out, "study chroma-thickness: 14 designs\nby formula alone: nothing is simulated\n");
  test::expect_refused(run_program({"plan", file, "--linear-range"}), "--linear-range: the study presses nothing");
}

TEST(PlanCommand, ChecksWhatAScenesPlanGoesBy) {
  const test::TemporaryFolder folder;
  const std::string job = test::write_small_job(folder).string();
  folder.write("scene.yaml", std::string(test::kSmallScene) + "accuracy: {}\n");
  const std::string cache = (folder.path() / "cache").string();
  const ProgramRun run =
      run_program({"--quiet", "--cache", cache, "plan", "--check", (folder.path() / "scene.yaml").string()});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  for (const char* effect : {"friction", "finite strain", "interreflection", "fine relief"}) {
    EXPECT_GE(count_of(run.out, std::string("\n") + effect), 2u) << effect << " in the plan and in the check\n"
                                                                 << run.out;
  }
  EXPECT_THAT(run.out, AllOf(HasSubstr("leaving it out changes"), HasSubstr("closely"), HasSubstr("verdict")));
  test::expect_refused(run_program({"plan", "--check", job}), "--check takes a scene's file");
}

}  // namespace
}  // namespace touchstone
