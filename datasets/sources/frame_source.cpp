#include "datasets/sources/frame_source.h"

#include <utility>

#include "sim/files/image_file.h"

namespace touchstone::datasets {
namespace {

class PictureFrames : public FrameSource {
 public:
  PictureFrames(std::shared_ptr<const FrameSequence> sequence, std::string folder)
      : sequence_(std::move(sequence)), folder_(std::move(folder)) {}

  bool next(SourceFrame& frame) override {
    if (next_ == sequence_->frames.size()) return false;
    frame = {};
    frame.label = sequence_->frames[next_++];
    frame.stem = folder_ + frame.label.file.stem().string();
    frame.title = frame.label.file.string();
    try {
      frame.image = sim::read_image(frame.label.file);
    } catch (const Error& error) {
      frame.fault = error.what();
    }
    return true;
  }

 private:
  std::shared_ptr<const FrameSequence> sequence_;
  std::string folder_;
  std::size_t next_ = 0;
};

}  // namespace

std::string name_in_table(const SourceFrame& frame) {
  return (std::filesystem::path(frame.stem).parent_path() / frame.label.file.filename()).string();
}

SourceFrame first_frame(FrameSource& source, const std::string& name) {
  SourceFrame frame;
  if (!source.next(frame)) fail("{}: has no frame", name);
  if (!frame.fault.empty()) fail("{}", frame.fault);
  return frame;
}

std::int64_t frames_of(const std::vector<FrameStream>& streams) {
  std::int64_t total = 0;
  for (const FrameStream& stream : streams) {
    if (!stream.frames) return 0;
    total += *stream.frames;
  }
  return total;
}

FrameStream picture_stream(FrameSequence sequence, const std::string& folder) {
  FrameStream stream;
  stream.name = sequence.name;
  stream.frames = static_cast<std::int64_t>(sequence.frames.size());
  auto shared = std::make_shared<const FrameSequence>(std::move(sequence));
  stream.open = [shared, folder] {
    return std::make_unique<PictureFrames>(shared, folder.empty() ? folder : folder + "/");
  };
  return stream;
}

std::vector<FrameStream> picture_streams(std::vector<FrameSequence> sequences) {
  std::vector<FrameStream> streams;
  const bool several = sequences.size() > 1;
  for (FrameSequence& sequence : sequences) {
    const std::string name = sequence.name;
    streams.push_back(picture_stream(std::move(sequence), several ? name : ""));
  }
  return streams;
}

}  // namespace touchstone::datasets
