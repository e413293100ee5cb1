#include "datasets/jobs/job.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "datasets/jobs/prepared_job.h"
#include "datasets/jobs/scene_plan.h"
#include "tests/support/message_of.h"
#include "tests/support/small_job.h"

namespace touchstone::datasets {
namespace {

using test::message_of;
using ::testing::AllOf;
using ::testing::HasSubstr;

std::string message_of_job(const std::string& text) {
  const test::TemporaryFolder folder;
  test::write_small_job(folder);
  const auto file = folder.write("job.yaml", text);
  return message_of([&] { prepare_job(file); });
}

TEST(Job, SamplesRunOverAllScenesInOrder) {
  const test::TemporaryFolder folder;
  const PreparedJob job = prepare_job(test::write_small_job(folder));
  ASSERT_EQ(job.scenes.size(), 2u);
  EXPECT_EQ(job.samples, 12);
  EXPECT_EQ(job.scenes[0].first_sample, 0);
  EXPECT_EQ(job.scenes[1].first_sample, 6);
  EXPECT_EQ(job.scenes[1].entry.split, Split::validate);
}

TEST(Job, StartAndSeedComeFromTheJob) {
  const test::TemporaryFolder folder;
  const PreparedJob job = prepare_job(test::write_small_job(folder));
  EXPECT_EQ(job.scenes[0].spec.motion.start_mm, Eigen::Vector3d(0, 0, 2.2));
  EXPECT_EQ(job.scenes[1].spec.motion.start_mm, Eigen::Vector3d(0.5, 0.2, 2.2));
  for (const PreparedScene& scene : job.scenes) EXPECT_EQ(scene.spec.seed, 11u);
}

TEST(Job, OutputsOfTheJobReplaceTheScenes) {
  const test::TemporaryFolder folder;
  test::write_small_job(folder);
  const auto file = folder.write("job.yaml", std::string(test::kSmallJob) + "outputs: {frames: false}\n");
  for (const PreparedScene& scene : prepare_job(file).scenes) {
    EXPECT_FALSE(scene.plan.camera);
    EXPECT_FALSE(scene.spec.outputs.radiance);
  }
}

TEST(Job, AccuracyOfTheJobCountsMoreThanTheScenes) {
  const test::TemporaryFolder folder;
  test::write_small_job(folder);
  folder.write("scene.yaml", std::string(test::kSmallScene) + "accuracy: {force_percent: 2, height_um: 9}\n");
  const auto file = folder.write("job.yaml", std::string(test::kSmallJob) + "accuracy: {force_percent: 3}\n");
  for (const PreparedScene& scene : prepare_job(file).scenes) {
    ASSERT_TRUE(scene.spec.accuracy);
    EXPECT_EQ(scene.spec.accuracy->force_percent, 3.0);
    EXPECT_EQ(scene.spec.accuracy->height_um, 9.0);
    EXPECT_FALSE(scene.spec.accuracy->pixel_noise);
  }
  EXPECT_THAT(message_of_job(std::string(test::kSmallJob) + "accuracy: {force_percent: 0}\n"),
              AllOf(HasSubstr("job.yaml:6"), HasSubstr("accuracy.force_percent")));
}

TEST(Job, NeedsAreKeptByTheContentsOfAllFilesOfAScene) {
  const test::TemporaryFolder folder;
  const test::TemporaryFolder cache;
  const auto file = test::write_small_job(folder);
  folder.write("job.yaml", std::string(test::kSmallJob) + "accuracy: {pixel_noise: 0.5}\n");
  const auto kept = [&] {
    int count = 0;
    for (const auto& entry : std::filesystem::directory_iterator(cache.path())) {
      count += entry.path().filename().string().starts_with("need-");
    }
    return count;
  };
  const auto why_of = [&] {
    PreparedJob job = prepare_job(file);
    plan_by_need(job, cache.path());
    std::string all;
    for (const PreparedScene& scene : job.scenes) {
      for (const sim::Effect& effect : scene.plan.effects) all += effect.why + "\n";
    }
    return all;
  };
  const std::string first = why_of();
  EXPECT_THAT(first, HasSubstr("(allowed 0.5)"));
  EXPECT_EQ(kept(), 2) << "the scenes begin in different places";
  EXPECT_EQ(why_of(), first);
  EXPECT_EQ(kept(), 2);
  folder.write("object.yaml", "name: ball\nshape: {type: sphere, radius_mm: 2}\nalbedo: 0\nfriction: 0.5\n");
  EXPECT_NE(why_of(), first);
  EXPECT_EQ(kept(), 4);
}

TEST(Job, InputsAreAllFilesThatItNames) {
  const test::TemporaryFolder folder;
  const PreparedJob job = prepare_job(test::write_small_job(folder));
  std::vector<std::string> names;
  for (const InputFile& file : job.inputs) names.push_back(file.name);
  EXPECT_THAT(names, ::testing::ElementsAre("device.yaml", "job.yaml", "motion.yaml", "object.yaml", "scene.yaml"));
}

TEST(Job, InputsFollowNamesThroughFoldersAndGltfBuffers) {
  const test::TemporaryFolder folder;
  folder.write("jobs/a.yaml", "x: ../scenes/s.yaml\ny: nowhere.yaml\nz: 3\n");
  folder.write("scenes/s.yaml", "deep: {list: [mesh.gltf, word]}\n");
  folder.write("scenes/mesh.gltf", R"({"buffers": [{"uri": "mesh.bin"}, {"uri": "data:base64,AAAA"}]})");
  folder.write("scenes/mesh.bin", "bytes");
  std::vector<std::string> names;
  for (const InputFile& file : input_files(folder.path() / "jobs/a.yaml")) names.push_back(file.name);
  EXPECT_THAT(names, ::testing::ElementsAre("../scenes/mesh.bin", "../scenes/mesh.gltf", "../scenes/s.yaml", "a.yaml"));
}

TEST(Job, AYamlFileThatHoldsItselfEnds) {
  const test::TemporaryFolder folder;
  const auto file = folder.write("a.yaml", "a: &a [*a, b.txt]\nself: a.yaml\n");
  EXPECT_EQ(input_files(file).size(), 1u);
}

TEST(JobErrors, NameFileAndLine) {
  EXPECT_THAT(message_of_job("name: a\nseed: 1\nscenes:\n  - {name: x, scene: scene.yaml, splitt: train}\n"),
              AllOf(HasSubstr("job.yaml:4:"), HasSubstr("unknown key 'splitt' (did you mean 'split'?)")));
  EXPECT_THAT(message_of_job("name: a\nseed: 1\nscens: []\n"), AllOf(HasSubstr("job.yaml:"), HasSubstr("'scenes'")));
  EXPECT_THAT(message_of_job("name: a\nseed: 1\nscenes: []\n"), AllOf(HasSubstr("job.yaml:3:"), HasSubstr("no scene")));
  EXPECT_THAT(message_of_job("name: a\nseed: -1\nscenes: []\n"), HasSubstr("job.yaml:2:"));
  EXPECT_THAT(message_of_job("name: a\nseed: 1\nextra: 1\nscenes:\n  - {name: x, scene: scene.yaml, split: train}\n"),
              AllOf(HasSubstr("job.yaml:3:"), HasSubstr("unknown key 'extra'")));
}

TEST(JobErrors, SceneThatIsntThere) {
  EXPECT_THAT(message_of_job("name: a\nseed: 1\nscenes:\n  - {name: x, scene: scane.yaml, split: train}\n"),
              AllOf(HasSubstr("job.yaml:4:"), HasSubstr("there is no file")));
}

TEST(JobErrors, UnknownSplitNamesTheNearest) {
  EXPECT_THAT(message_of_job("name: a\nseed: 1\nscenes:\n  - {name: x, scene: scene.yaml, split: trai}\n"),
              AllOf(HasSubstr("job.yaml:4:"), HasSubstr("did you mean 'train'?")));
}

TEST(JobErrors, NamesMustBeFoldersOfTheirOwn) {
  EXPECT_THAT(message_of_job("name: a\nseed: 1\nscenes:\n  - {name: ../x, scene: scene.yaml, split: train}\n"),
              AllOf(HasSubstr("job.yaml:4:"), HasSubstr("can't name a folder")));
  EXPECT_THAT(message_of_job("name: a\nseed: 1\nscenes:\n  - {name: x, scene: scene.yaml, split: train}\n"
                             "  - {name: x, scene: scene.yaml, split: test}\n"),
              AllOf(HasSubstr("job.yaml:5:"), HasSubstr("a second time")));
}

TEST(JobErrors, NotANumberIsRefused) {
  EXPECT_THAT(
      message_of_job(
          "name: a\nseed: 1\nscenes:\n  - {name: x, scene: scene.yaml, split: train, start_mm: [0, .nan, 1]}\n"),
      AllOf(HasSubstr("job.yaml:4:"), HasSubstr("finite")));
}

TEST(JobErrors, TwoDevicesInOneDataSetAreRefused) {
  const test::TemporaryFolder folder;
  test::write_small_job(folder);
  folder.write("device2.yaml", std::string(test::kSmallDevice) + test::kSmallCamera);
  folder.write("scene2.yaml", "device: device2.yaml\nobject: object.yaml\nmotion: motion.yaml\n");
  const auto file = folder.write("job.yaml",
                                 "name: a\nseed: 1\nscenes:\n  - {name: x, scene: scene.yaml, split: train}\n"
                                 "  - {name: y, scene: scene2.yaml, split: test}\n");
  EXPECT_THAT(message_of([&] { prepare_job(file); }), AllOf(HasSubstr("job.yaml:5:"), HasSubstr("one device")));
}

TEST(JobErrors, ScenesOfUnlikeNumbersOfObjectsAreRefused) {
  const test::TemporaryFolder folder;
  test::write_small_job(folder);
  folder.write("scene2.yaml",
               "device: device.yaml\nobject: object.yaml\nmotion: motion.yaml\n"
               "more_objects: [{object: object.yaml, motion: motion.yaml, start_mm: [3, 0, 1]}]\n");
  const auto file = folder.write("job.yaml",
                                 "name: a\nseed: 1\nscenes:\n  - {name: x, scene: scene.yaml, split: train}\n"
                                 "  - {name: y, scene: scene2.yaml, split: test}\n");
  EXPECT_THAT(message_of([&] { prepare_job(file); }),
              AllOf(HasSubstr("job.yaml:5:"), HasSubstr("'y' has 2 objects, but 'x' has 1")));
}

TEST(JobErrors, ImageWithoutACameraIsRefused) {
  const test::TemporaryFolder folder;
  const auto file = test::write_small_job(folder);
  folder.write("device.yaml", test::kSmallDevice);
  EXPECT_THAT(message_of([&] { prepare_job(file); }), AllOf(HasSubstr("scene.yaml:"), HasSubstr("camera")));
}

TEST(Job, IsDistinguishedFromASceneByItsScenes) {
  const test::TemporaryFolder folder;
  EXPECT_TRUE(is_job_file(test::write_small_job(folder)));
  EXPECT_FALSE(is_job_file(folder.path() / "scene.yaml"));
}

}  // namespace
}  // namespace touchstone::datasets
