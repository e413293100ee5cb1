// `touchstone study` as a user runs it, on a study that needs no press.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "core/whole_file.h"
#include "tests/apps/run_program.h"
#include "tests/support/temporary_folder.h"

namespace touchstone {
namespace {

namespace fs = std::filesystem;
using test::ProgramRun;
using test::run_program;
using ::testing::HasSubstr;

constexpr const char* kStudy =
    "name: thin\nkind: apparent_change\ndevice: d.yaml\nvary: {field: gel.thickness_mm, values: [2, 4, 6]}\n"
    "lenses_mm: [24]\nobjects: [ball.yaml]\nforce_N: [0.1]\nby: [formula]\n";

class StudyCommand : public ::testing::Test {
 protected:
  StudyCommand() {
    folder_.write("d.yaml",
                  "name: d\ngel: {size_x_mm: 8, size_y_mm: 8, thickness_mm: 2, youngs_modulus_MPa: 0.4,\n"
                  "      poisson_ratio: 0.5, refractive_index: 1.41}\n"
                  "mesh: {fine_mm: 0.6, coarse_mm: 1.5, fine_half_extent_mm: [1, 1], fine_depth_mm: 0.5}\n"
                  "plate: {thickness_mm: 3, refractive_index: 1.49}\n");
    folder_.write("ball.yaml", "name: ball\nshape: {type: sphere, radius_mm: 2}\nalbedo: 0.5\n");
  }
  ProgramRun study(const std::string& text) {
    return run_program(
        {"--quiet", "--cache", in("cache"), "study", folder_.write("s.yaml", text).string(), "-o", in("out")});
  }
  std::string in(const std::string& name) const { return (folder_.path() / name).string(); }

  test::TemporaryFolder folder_;
};

TEST_F(StudyCommand, WritesTablesAndPlotsAndDoesSoAgain) {
  const ProgramRun run = study(kStudy);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  for (const char* name :
       {"thin.csv", "thin.md", "thin-ball-0.1N-relative_whole_fixed.svg", "thin-ball-0.1N-picture_film_fixed.svg"}) {
    EXPECT_THAT(run.out, HasSubstr(in("out/") + name));
    EXPECT_TRUE(fs::exists(in("out/") + name));
  }
  const std::string csv = read_whole_file(in("out/thin.csv"));
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 4);
  EXPECT_THAT(csv, HasSubstr("\nmarker,formula,0.1,4,24,0.25,1.03125,0.0625,"));  // 0.1 N on 4 mm^2 of 0.4 MPa
  ASSERT_EQ(study(kStudy).exit_code, 0);
  EXPECT_EQ(read_whole_file(in("out/thin.csv")), csv);
}

TEST_F(StudyCommand, RefusesMistakesWithOneLineAndWritesNothing) {
  const auto refused = [&](const ProgramRun& run, const std::string& part) {
    test::expect_refused(run, part);
    EXPECT_FALSE(fs::exists(in("out")));
  };
  refused(study("name: thin\n"), "kind");
  refused(study(std::string(kStudy) + "forces: 3\n"), "s.yaml:9: unknown key 'forces'");
  refused(run_program({"study", in("none.yaml"), "-o", in("out")}), "none.yaml");
  refused(run_program({"study", in("d.yaml")}), "--out");
}

TEST_F(StudyCommand, RefusesAFileForAFolder) {
  folder_.write("out", "a file");
  const ProgramRun run = study(kStudy);
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr(in("out")));
}

}  // namespace
}  // namespace touchstone
