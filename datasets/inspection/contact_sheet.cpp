#include "datasets/inspection/contact_sheet.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "core/error.h"

namespace touchstone::datasets {
namespace {

constexpr int kGap_px = 8;
constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
constexpr double kFontScale = 0.5;  // capitals 11 px high: smaller ones of this font blur
constexpr int kLine_px = 18;
constexpr int kLongestSide_px = 30000;

int text_width(const std::string& text) {
  return cv::getTextSize(text, kFont, kFontScale, 1, nullptr).width;
}

std::vector<std::string> broken_lines(const std::string& caption, int width_px) {
  std::vector<std::string> lines;
  std::istringstream paragraphs(caption);
  for (std::string paragraph; std::getline(paragraphs, paragraph);) {
    std::istringstream words(paragraph);
    std::string line;
    for (std::string word; words >> word;) {
      const std::string longer = line.empty() ? word : line + " " + word;
      if (!line.empty() && text_width(longer) > width_px) {
        lines.push_back(line);
        line = word;
      } else {
        line = longer;
      }
    }
    lines.push_back(line);
  }
  return lines;
}

cv::Mat tile_of(const cv::Mat& image, int width_px) {
  const double scale = static_cast<double>(width_px) / image.cols;
  const int height = std::max(1, static_cast<int>(std::lround(image.rows * scale)));
  if (height > kLongestSide_px) fail("contact sheet: an image of {}x{} pixels is too slender", image.cols, image.rows);
  cv::Mat eight;
  image.convertTo(eight, CV_8U, image.depth() == CV_16U ? 1.0 / 257.0 : 1.0);
  if (eight.channels() == 1) cv::cvtColor(eight, eight, cv::COLOR_GRAY2BGR);
  cv::Mat tile;
  cv::resize(eight, tile, cv::Size(width_px, height), 0.0, 0.0, scale < 1.0 ? cv::INTER_AREA : cv::INTER_LINEAR);
  return tile;
}

void check(const std::vector<cv::Mat>& images, const std::vector<std::string>& captions, int columns, int width_px) {
  if (images.empty()) fail("contact sheet: there is no image");
  if (images.size() != captions.size()) {
    fail("contact sheet: {} captions for {} images", captions.size(), images.size());
  }
  if (columns < 1) fail("contact sheet: {} columns; allowed is at least 1", columns);
  if (width_px < 32) fail("contact sheet: tiles of {} px; allowed is at least 32", width_px);
  if (static_cast<double>(columns) * (width_px + kGap_px) + kGap_px > kLongestSide_px) {
    fail("contact sheet: {} columns of {} px are wider than {} px", columns, width_px, kLongestSide_px);
  }
  for (std::size_t i = 0; i < images.size(); ++i) {
    const cv::Mat& image = images[i];
    const bool depth_fits = image.depth() == CV_8U || image.depth() == CV_16U;
    const bool channels_fit = image.channels() == 1 || image.channels() == 3;
    if (image.empty() || image.dims != 2 || !depth_fits || !channels_fit) {
      fail("contact sheet: image {} must not be empty, of 8 or 16 bit, with 1 or 3 channels", i);
    }
  }
}

}  // namespace

cv::Mat contact_sheet(const std::vector<cv::Mat>& images, const std::vector<std::string>& captions, int columns,
                      int tile_width_px) {
  check(images, captions, columns, tile_width_px);
  std::vector<cv::Mat> tiles;
  std::vector<std::vector<std::string>> texts;
  for (std::size_t i = 0; i < images.size(); ++i) {
    tiles.push_back(tile_of(images[i], tile_width_px));
    texts.push_back(broken_lines(captions[i], tile_width_px));
  }
  struct Row {
    int picture_px = 0;
    int lines = 0;
  };
  const auto per_row = static_cast<std::size_t>(columns);
  std::vector<Row> rows((images.size() + per_row - 1) / per_row);
  for (std::size_t i = 0; i < images.size(); ++i) {
    Row& row = rows[i / per_row];
    row.picture_px = std::max(row.picture_px, tiles[i].rows);
    row.lines = std::max(row.lines, static_cast<int>(texts[i].size()));
  }
  std::int64_t height = kGap_px;
  for (const Row& row : rows) height += row.picture_px + row.lines * kLine_px + kGap_px;
  if (height > kLongestSide_px) fail("contact sheet: it would be {} px high; allowed is {}", height, kLongestSide_px);

  const int used_columns = static_cast<int>(std::min(per_row, images.size()));
  cv::Mat sheet(static_cast<int>(height), kGap_px + used_columns * (tile_width_px + kGap_px), CV_8UC3,
                cv::Scalar::all(255));
  int top = kGap_px;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    for (std::size_t i = r * per_row; i < std::min(images.size(), (r + 1) * per_row); ++i) {
      const int left = kGap_px + static_cast<int>(i % per_row) * (tile_width_px + kGap_px);
      tiles[i].copyTo(sheet(cv::Rect(left, top, tiles[i].cols, tiles[i].rows)));
      int baseline = top + tiles[i].rows + kLine_px - 4;
      for (const std::string& line : texts[i]) {
        const int width = text_width(line);
        const double scale = width > tile_width_px ? kFontScale * tile_width_px / width : kFontScale;
        cv::putText(sheet, line, {left, baseline}, kFont, scale, cv::Scalar::all(0), 1, cv::LINE_AA);
        baseline += kLine_px;
      }
    }
    top += rows[r].picture_px + rows[r].lines * kLine_px + kGap_px;
  }
  return sheet;
}

}  // namespace touchstone::datasets
