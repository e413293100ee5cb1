#include "lab/vhs/vhs_experiment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "sim/files/image_file.h"
#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::lab {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

ForceRecord record(double x, double y, double z, double error_x, double error_y, double error_z) {
  ForceRecord one;
  one.truth = Eigen::Vector3d(x, y, z);
  one.estimate.force = Eigen::Vector3d(x + error_x, y + error_y, z + error_z);
  return one;
}

TEST(ForceErrors, AreMeanRmsAndLargestOfEachAxis) {
  const auto errors = force_errors({record(0, 0, 1, 0.3, 0, -0.1), record(0, 0, 2, -0.4, 0, -0.1)});
  EXPECT_DOUBLE_EQ(errors[0].mean_absolute, 0.35);
  EXPECT_DOUBLE_EQ(errors[0].rms, std::sqrt(0.125));
  EXPECT_DOUBLE_EQ(errors[0].largest, 0.4);
  EXPECT_DOUBLE_EQ(errors[1].mean_absolute, 0.0);
  EXPECT_NEAR(errors[2].mean_absolute, 0.1, 1e-12);
  EXPECT_EQ(errors[2].frames, 2);
}

TEST(ForceErrors, LeaveOutFramesWithoutTruth) {
  ForceRecord unknown;
  unknown.estimate.force = {5, 5, 5};
  EXPECT_EQ(force_errors({unknown})[0].frames, 0);
}

TEST(Verification, CountsNormalForceWithoutShearAndShearWhereThereIsSome) {
  const Verification v =
      verify_forces({record(0, 0, 0.5, 0, 0, 0.05), record(0, 0, 5.0, 0, 0, 0.1), record(0.3, 0, 3.5, 0.02, 0, 9),
                     record(0, -1.5, 3.5, 9, 0.04, 9), record(0, 0, 0, 9, 9, 9)});
  ASSERT_EQ(v.levels[2].size(), 2u);
  EXPECT_DOUBLE_EQ(v.levels[2][0].load, 0.5);
  EXPECT_NEAR(v.levels[2][1].mean_estimated, 5.1, 1e-12);
  ASSERT_EQ(v.levels[0].size(), 1u);
  EXPECT_NEAR(v.errors[0].mean_absolute, 0.02, 1e-12);
  ASSERT_EQ(v.levels[1].size(), 1u);
  EXPECT_DOUBLE_EQ(v.levels[1][0].load, -1.5);
  EXPECT_NEAR(v.errors[2].mean_absolute, 0.075, 1e-12);
  ASSERT_TRUE(v.error_at_5N_percent.has_value());
  EXPECT_NEAR(*v.error_at_5N_percent, 2.0, 1e-9);
}

TEST(Verification, SaysNothingOf5NWhereThereIsNone) {
  EXPECT_FALSE(verify_forces({record(0, 0, 3.5, 0, 0, 1)}).error_at_5N_percent.has_value());
}

constexpr double kPxPerN = 2.0;

/// Nine discs on grey, 60 px apart, moved by (2 px/N) F_x and F_y and spread by F_z.
cv::Mat picture_of(const Eigen::Vector3d& force) {
  cv::Mat picture(240, 320, CV_8UC3, cv::Scalar::all(170));
  for (int row = 0; row < picture.rows; ++row) {
    for (int column = 0; column < picture.cols; ++column) {
      double cover = 0.0;
      for (int bead = 0; bead < 9; ++bead) {
        const double spread = 60.0 + kPxPerN * force.z();
        const double x = 160.0 + (bead % 3 - 1) * spread + kPxPerN * force.x();
        const double y = 120.0 + (bead / 3 - 1) * spread + kPxPerN * force.y();
        cover = std::max(cover, std::clamp(8.5 - std::hypot(column + 0.5 - x, row + 0.5 - y), 0.0, 1.0));
      }
      picture.at<cv::Vec3b>(row, column) = cv::Vec3b::all(cv::saturate_cast<unsigned char>(170 - 120 * cover));
    }
  }
  return picture;
}

/// A recording with its table of forces: a slow walk through x, y and z.
std::string write_recording(const test::TemporaryFolder& folder, int frames) {
  std::string table = "file,t_us,force_x_N,force_y_N,force_z_N\n";
  for (int i = 0; i < frames; ++i) {
    const Eigen::Vector3d force(std::sin(0.4 * i), std::sin(0.7 * i), 2.0 - 2.0 * std::cos(0.3 * i));
    const std::string name = fmt::format("frame{:03}.png", i);
    sim::write_png(folder.path() / name, picture_of(force));
    table += fmt::format("{},{},{},{},{}\n", name, 33333 * i, force.x(), force.y(), force.z());
  }
  return table;
}

// Four squares of four beads: beads that all move by d have 16 d of U_s,x. Beads 70 px apart that go apart by a part s
// each have p_z larger by 70 s px: 16 of them again.
TEST(ForceRelations, AreThoseThatTheForcesWereMadeOf) {
  sensors::ForceSamples samples;
  const auto beads = [](double shift, double part) {
    std::vector<Eigen::Vector2d> all;
    for (int row = -1; row <= 1; ++row) {
      for (int column = -1; column <= 1; ++column) {
        all.emplace_back(320.0 + shift + 70.0 * (1.0 + part) * column, 240.0 - shift + 70.0 * (1.0 + part) * row);
      }
    }
    return all;
  };
  samples.rest = beads(0.0, 0.0);
  for (const double shift : {-2.0, 0.5, 3.0}) {
    for (const double part : {0.0, 0.01, 0.03}) {
      samples.positions.push_back(beads(shift, part));
      samples.forces.emplace_back(0.05 * 16.0 * shift, shift * shift, 0.1 * 16.0 * 70.0 * part + 0.02 * 16.0 * shift);
    }
  }
  const ForceRelations relations = force_relations(samples);
  EXPECT_NEAR(relations.axes[0].slope, 0.05, 1e-12);
  EXPECT_NEAR(relations.axes[0].r2, 1.0, 1e-12);
  EXPECT_NEAR(relations.axes[2].slope, 0.1, 1e-12);
  EXPECT_LT(relations.axes[2].r2, 0.95) << "the shift is in F_z, too";
  EXPECT_NEAR(relations.z_of_all_r2, 1.0, 1e-12);
}

TEST(VhsExperiment, ForcesOfARecordingAreRecovered) {
  const test::TemporaryFolder folder;
  const auto csv = folder.write("forces.csv", write_recording(folder, 40));
  const auto tracked = track({datasets::picture_stream(datasets::frames_of_force_table(folder.path(), csv))}, {});
  EXPECT_EQ(tracked[0].lost(), 0);
  sensors::ForceSamples samples = training_samples(tracked, 3);
  EXPECT_EQ(samples.forces.size(), 40u);
  const auto trained = sensors::train(samples, sensors::TrainingSettings::to_convergence());
  const auto errors = force_errors(estimate_forces(tracked, trained.model, RestChoice::model));
  for (int axis = 0; axis < 3; ++axis) EXPECT_LT(errors[axis].mean_absolute, 0.05) << axis;
  const auto own_rest = estimate_forces(tracked, trained.model, RestChoice::first_frame);
  EXPECT_EQ(own_rest[0].estimate.force.norm(), 0.0) << "the first frame is the rest";
}

TEST(VhsExperiment, AFirstFrameWithoutBeadsIsRefused) {
  const test::TemporaryFolder folder;
  for (int i = 0; i < 3; ++i) {
    cv::Mat grey(240, 320, CV_8UC3, cv::Scalar::all(170));
    grey.at<cv::Vec3b>(1, 1) = {0, 0, 0};
    sim::write_png(folder.path() / fmt::format("{}.png", i), grey);
  }
  const auto tracked = track({datasets::picture_stream(datasets::frames_of_folder(folder.path()))}, {});
  try {
    training_samples(tracked, 3);
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("0 of 9 beads"));
  }
}

std::string message_of_table(const std::string& text) {
  const test::TemporaryFolder folder;
  folder.write("a.png", "x");
  try {
    datasets::frames_of_force_table(folder.path(), folder.write("forces.csv", text));
  } catch (const Error& error) {
    return error.what();
  }
  return "nothing was thrown";
}

TEST(ForceTable, ErrorsNameTheLine) {
  const std::string header = "file,t_us,force_x_N,force_y_N,force_z_N\n";
  EXPECT_THAT(message_of_table("file,time\n"), HasSubstr("forces.csv:1:"));
  EXPECT_THAT(message_of_table(header), HasSubstr("has no frame"));
  EXPECT_THAT(message_of_table(header + "a.png,0,1,2\n"), HasSubstr("forces.csv:2: has 4 cells"));
  EXPECT_THAT(message_of_table(header + "b.png,0,1,2,3\n"), HasSubstr("forces.csv:2: there is no file"));
  EXPECT_THAT(message_of_table(header + "a.png,zero,1,2,3\n"), HasSubstr("t_us"));
  EXPECT_THAT(message_of_table(header + "a.png,0,1,2,nan\n"), HasSubstr("isn't a finite number"));
  EXPECT_THAT(message_of_table(header + "a.png,0,1,2,3\na.png,0,1,2,3\n"), HasSubstr("forces.csv:3:"));
}

TEST(FramesOfFolder, AreInTheOrderOfTheirNames) {
  const test::TemporaryFolder folder;
  for (const char* name : {"b.png", "a.png", "c.png", "notes.txt"}) folder.write(name, "x");
  const datasets::FrameSequence sequence = datasets::frames_of_folder(folder.path());
  ASSERT_EQ(sequence.frames.size(), 3u);
  EXPECT_EQ(sequence.frames[1].file.filename(), "b.png");
  EXPECT_FALSE(sequence.frames[2].timed);
  EXPECT_GT(sequence.frames[2].t_us, sequence.frames[1].t_us);
  EXPECT_THROW(datasets::frames_of_folder(folder.path() / "none"), Error);
}

TEST(FramesOfFolder, AreInNaturalOrderWhateverTheirKinds) {
  const test::TemporaryFolder folder;
  for (const char* name : {"0.png", "1.bmp", "10.tif", "11.JPG", "2.tiff", "._1.bmp", ".hidden.png", "Thumbs.db",
                           ".DS_Store", "desktop.ini", "depth.exr"}) {
    folder.write(name, "x");
  }
  std::filesystem::create_directory(folder.path() / "3.png");
  std::filesystem::create_symlink("nowhere", folder.path() / "4.png");
  std::vector<std::string> names;
  for (const auto& file : datasets::picture_files(folder.path())) names.push_back(file.filename());
  EXPECT_THAT(names, testing::ElementsAre("0.png", "1.bmp", "2.tiff", "4.png", "10.tif", "11.JPG"));
}

TEST(FramesOfFolder, WhatWouldBeMissingOrTwiceIsNamed) {
  const auto fault = [](const std::vector<std::string>& names) {
    const test::TemporaryFolder folder;
    for (const std::string& name : names) folder.write(name, "x");
    return test::message_of([&] { datasets::picture_files(folder.path()); });
  };
  EXPECT_THAT(fault({"1.png", "2.gif"}), HasSubstr("2.gif: is a picture of a kind that isn't read here"));
  EXPECT_THAT(fault({"1.png", "2.png", "2.jpg"}), HasSubstr("2.png: 2.jpg has the same name"));
  EXPECT_THAT(fault({"._1.png", "notes.txt"}), HasSubstr("has no picture"));
  EXPECT_EQ(fault({"01.png", "1.png"}), "no error");
}

TEST(VhsExperiment, AFrameThatCantBeReadIsLeftOutAndNamed) {
  const test::TemporaryFolder folder;
  const auto csv = folder.write("forces.csv", write_recording(folder, 6));
  folder.write("frame003.png", "damaged");
  const auto tracked = track({datasets::picture_stream(datasets::frames_of_force_table(folder.path(), csv))}, {});
  ASSERT_EQ(tracked[0].faults.size(), 1u);
  EXPECT_THAT(tracked[0].faults[0], HasSubstr("frame003.png: can't be read as an image"));
  ASSERT_EQ(tracked[0].source.frames.size(), 5u);
  ASSERT_EQ(tracked[0].beads.size(), 5u);
  EXPECT_EQ(tracked[0].source.frames[3].frame, 4) << "the others keep their numbers";
  EXPECT_EQ(training_samples(tracked, 3).forces.size(), 5u);

  folder.write("frame000.png", "damaged");
  const auto without_first = track({datasets::picture_stream(datasets::frames_of_force_table(folder.path(), csv))}, {});
  EXPECT_THAT(test::message_of([&] { training_samples(without_first, 3); }),
              HasSubstr("its first frame, which must show the beads without load, can't be used: "));
  for (int i = 0; i < 6; ++i) folder.write(fmt::format("frame{:03}.png", i), "damaged");
  EXPECT_THAT(test::message_of(
                  [&] { track({datasets::picture_stream(datasets::frames_of_force_table(folder.path(), csv))}, {}); }),
              HasSubstr("none of 6 frames can be used; the first: "));
}

TEST(ForceTable, MayHaveAMarkAndNamesInQuotes) {
  const test::TemporaryFolder folder;
  const std::string header = "file,t_us,force_x_N,force_y_N,force_z_N";
  folder.write("a, \"b\".png", "x");
  const auto read = [&](const std::string& text) {
    return datasets::frames_of_force_table(folder.path(), folder.write("forces.csv", text)).frames;
  };
  const auto frames = read("\xef\xbb\xbf\"file\"," + header.substr(5) + "\r\n\"a, \"\"b\"\".png\",7,1,2,\"3\"\r\n");
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_EQ(frames[0].file.filename(), "a, \"b\".png");
  EXPECT_EQ(frames[0].force, Eigen::Vector3d(1, 2, 3));
  EXPECT_THAT(message_of_table(header + "\n\"a.png,0,1,2,3\n"), HasSubstr("forces.csv:2: a quote has no end"));
  EXPECT_THAT(message_of_table(header + "\n\"a\".png,0,1,2,3\n"), HasSubstr("stands behind a quote's end"));
  EXPECT_THAT(message_of_table("\xff\xfe"
                               "f"),
              HasSubstr("UTF-16"));
}

}  // namespace
}  // namespace touchstone::lab
