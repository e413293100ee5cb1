#pragma once
// Pictures on disk: PNG for frames, EXR for linear light, through OpenImageIO. That library costs 0.3 s and 130 MB when
// it is loaded, so it sits in a module of its own (sim/files/image_module.h), which the first of these calls loads.

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>
#include <utility>
#include <vector>

namespace touchstone::sim {

/// Keys and values that are kept in a file beside the pixels.
using ImageMetadata = std::vector<std::pair<std::string, std::string>>;

/// Writes a PNG: 8 or 16 bit, one channel (grey) or three (BGR in memory). The same picture and metadata give the same
/// bytes: there's no time stamp. The file is there whole or not at all.
/// @throws Error for a picture of another type, or naming the file that can't be written
void write_png(const std::filesystem::path& path, const cv::Mat& image, const ImageMetadata& metadata = {});

/// Writes an EXR of 32 bit floats (losslessly compressed). Channels keep their order in memory: the i-th is called
/// `channel_names[i]`. Same bytes, whole or not at all, as write_png; the date that an EXR must have is always 1970.
/// @throws Error also for names that are empty, double, or not as many as there are channels
void write_exr(const std::filesystem::path& path, const cv::Mat& image, const std::vector<std::string>& channel_names,
               const ImageMetadata& metadata = {});

/// Reads a PNG, TIFF, JPEG or what else OpenImageIO knows, in 8 or 16 bit as it is stored: one channel (grey) or three
/// (BGR), turned as its EXIF orientation says. An alpha channel is left out. @throws Error naming the file if it can't
/// be read, is damaged, or holds floats
cv::Mat read_image(const std::filesystem::path& path);

/// A picture of floats with its channels by name.
struct LinearImage {
  cv::Mat image;                           ///< CV_32FC(n)
  std::vector<std::string> channel_names;  ///< n
};

/// Reads an EXR (or another file of floats). Channels come in the file's order, which is alphabetic for EXR but for
/// R, G, B, A: go by their names. @throws Error naming the file
LinearImage read_exr(const std::filesystem::path& path);

/// The text that a picture's file keeps under `key`, or the empty string. @throws Error if the file can't be read
std::string image_metadata(const std::filesystem::path& path, const std::string& key);

}  // namespace touchstone::sim
