#include "lab/dtact/dark_presses.h"

#include "core/error.h"

namespace touchstone::lab {

namespace fs = std::filesystem;

sensors::RestPicture read_rest_picture(datasets::TableFrames& frames, const std::vector<fs::path>& files) {
  std::vector<cv::Mat> pictures;
  std::optional<sensors::RestPicture> first;
  for (const fs::path& file : files) {
    pictures.push_back(frames.read(file));
    try {  // each by itself, so that an error can name its file
      const sensors::RestPicture alone = sensors::mean_rest(std::span(&pictures.back(), 1));
      if (!first) first = alone;
      const std::string fault = sensors::unfit_frame(pictures.back(), *first);
      if (!fault.empty()) fail("the frame {}", fault);
    } catch (const Error& error) {
      fail("{}: {}", file.string(), error.what());
    }
  }
  return sensors::mean_rest(pictures);
}

std::vector<sensors::BallPress> read_dark_presses(datasets::TableFrames& frames,
                                                  const std::vector<AnnotatedPress>& table,
                                                  const sensors::RestPicture& rest,
                                                  const sensors::DarkeningSettings& settings,
                                                  const sensors::PressScale& scale) {
  std::vector<sensors::BallPress> presses;
  for (const AnnotatedPress& annotated : table) {
    try {
      sensors::BallPress press;
      press.name = annotated.file.filename().string();
      press.frame = frames.read(annotated.file);
      press.ball_radius_mm = 0.5 * annotated.ball_diameter_mm;
      press.circle = annotated.circle ? *annotated.circle
                                      : sensors::find_dark_circle(press.frame, rest, settings, press.ball_radius_mm,
                                                                  scale, press.name);
      presses.push_back(std::move(press));
    } catch (const Error& error) {
      fail_at(annotated.where, "{}", error.what());
    }
  }
  return presses;
}

}  // namespace touchstone::lab
