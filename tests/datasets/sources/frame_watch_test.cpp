#include "datasets/sources/frame_watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>

namespace touchstone::datasets {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

/// A frame of one grey at a time; 0 is damaged.
struct Planned {
  std::int64_t t_us;
  int grey;
};

FrameStream stream_of(std::vector<Planned> planned, bool timed = true) {
  class Frames : public FrameSource {
   public:
    Frames(std::vector<Planned> planned, bool timed) : planned_(std::move(planned)), timed_(timed) {}
    bool next(SourceFrame& frame) override {
      if (next_ == planned_.size()) return false;
      frame = {};
      frame.label.frame = static_cast<int>(next_);
      frame.label.t_us = planned_[next_].t_us;
      frame.label.timed = timed_;
      frame.title = fmt::format("clip: frame {}", next_);
      frame.image = cv::Mat(4, 6, CV_8UC3, cv::Scalar::all(planned_[next_].grey));
      if (planned_[next_].grey == 0) frame = {frame.label, "", frame.title, {}, frame.title + " is damaged"};
      ++next_;
      return true;
    }

   private:
    std::vector<Planned> planned_;
    bool timed_;
    std::size_t next_ = 0;
  };
  FrameStream stream;
  stream.name = "clip";
  stream.open = [planned, timed] { return std::make_unique<Frames>(planned, timed); };
  return stream;
}

FrameNotes notes_of(const FrameStream& stream, bool draws_into_frames = false) {
  auto notes = std::make_shared<FrameNotes>();
  const FrameStream seen = watched(stream, notes);
  for (int twice = 0; twice < 2; ++twice) {
    for_each_frame({seen}, [&](const SourceFrame& frame) {
      if (draws_into_frames && !frame.image.empty()) cv::Mat(frame.image).setTo(9);
    });
  }
  return *notes;
}

/// Thirty a second, some microseconds early or late.
std::vector<Planned> steady(int count) {
  std::vector<Planned> planned;
  for (int k = 0; k < count; ++k) planned.push_back({33333LL * k + (k % 3) * 900, 10 + k});
  return planned;
}

TEST(FrameWatch, ASteadyRecordingHasNothingToNote) {
  const FrameNotes notes = notes_of(stream_of(steady(100)));
  EXPECT_THAT(notes.doubled, IsEmpty());
  EXPECT_THAT(notes.gaps, IsEmpty());
}

TEST(FrameWatch, DoubledFramesAreNamedOnce) {
  std::vector<Planned> planned = steady(20);
  planned[7].grey = planned[6].grey;
  planned[8].grey = planned[6].grey;
  EXPECT_THAT(notes_of(stream_of(planned)).doubled, ElementsAre("clip: frame 7", "clip: frame 8"));
  EXPECT_THAT(notes_of(stream_of(planned), true).doubled, ElementsAre("clip: frame 7", "clip: frame 8"));
}

TEST(FrameWatch, ADamagedFrameIsntTheOneBefore) {
  std::vector<Planned> planned = steady(20);
  planned[7].grey = 0;
  planned[8].grey = planned[6].grey;
  EXPECT_THAT(notes_of(stream_of(planned)).doubled, ElementsAre("clip: frame 8")) << "of the last picture there was";
}

TEST(FrameWatch, MissingFramesAreCounted) {
  std::vector<Planned> planned = steady(60);
  planned.erase(planned.begin() + 20);
  planned.erase(planned.begin() + 40, planned.begin() + 45);
  EXPECT_THAT(notes_of(stream_of(planned)).gaps, ElementsAre("clip: frame 20: about one frame is missing before it",
                                                             "clip: frame 40: about 5 frames are missing before it"));
}

TEST(FrameWatch, WithoutTimesThereAreNoGapsAndARateThatChangesIsGotUsedTo) {
  std::vector<Planned> planned = steady(30);
  planned.erase(planned.begin() + 20, planned.begin() + 25);
  EXPECT_THAT(notes_of(stream_of(planned, false)).gaps, IsEmpty());
  planned = steady(20);
  for (int k = 0; k < 40; ++k) planned.push_back({planned.back().t_us + 100000, 100 + k});
  EXPECT_THAT(notes_of(stream_of(planned)).gaps, ::testing::SizeIs(8)) << "until it is the usual one";
}

}  // namespace
}  // namespace touchstone::datasets
