#include "lab/fit/unit_pictures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "sim/files/image_file.h"

namespace touchstone::lab {
namespace {

constexpr double kWhite = 250.0;  // of 255: noise takes some exposures of such a pixel to the end
constexpr double kBlack = 1.5;    // below, rounding no longer averages out
constexpr double kMostWhite = 1.0 / 3.0;
constexpr double kFullScale = 255.0;

/// How the numbers of one channel come of electrons, and what noise they have.
struct Channel {
  Eigen::RowVectorXd electrons_per_light;  ///< by band
  double dark_e, number_per_e, read_e, prnu, dsnu_e, step;
  double samples;  ///< of the mosaic, of a pixel
};

std::vector<Channel> channels_of(const render::Imager& imager) {
  std::vector<Channel> channels;
  const render::QuantumEfficiency per_light = render::response_of(imager).electrons_per_irradiance;
  const bool mosaic = imager.bayer != render::BayerPattern::none && imager.bayer != render::BayerPattern::binned;
  const double largest = (1 << imager.bits) - 1;
  for (Eigen::Index c = 0; c < imager.quantum_efficiency.rows(); ++c) {
    const render::Imager one = render::channel_imager(imager, static_cast<int>(c));
    const double scale = imager.white_balance[c] * kFullScale / (largest - imager.black_level_DN);
    Channel channel;
    channel.electrons_per_light = per_light.row(c);
    channel.dark_e = one.dark_current_e_per_s * one.exposure_s;
    channel.number_per_e = one.gain_DN_per_e * scale;
    channel.read_e = one.read_noise_e;
    channel.prnu = one.prnu;
    channel.dsnu_e = one.dsnu_e;
    channel.step = scale;
    channel.samples = !mosaic ? 1.0 : c == 1 ? 0.5 : 0.25;  // a quarter of a mosaic is red
    channels.push_back(channel);
  }
  return channels;
}

/// Pictures have blue first.
int place_of(int channel, int channels) {
  return channels == 3 ? 2 - channel : channel;
}

bool is_white(double number) {
  return number >= kWhite;
}

}  // namespace

BlockPicture block_picture(const cv::Mat& picture, const std::string& name, const sim::CameraSpec& camera, int block_px,
                           const SourceLocation& where) {
  const int channels = camera.bayer == render::BayerPattern::none ? 1 : 3;
  if (picture.cols != camera.width || picture.rows != camera.height) {
    fail_at(where, "{}: has {} x {} pixels; the device's camera has {} x {}", name, picture.cols, picture.rows,
            camera.width, camera.height);
  }
  if (picture.type() != CV_8UC(channels)) {
    fail_at(where, "{}: has {} channels of {} bits; the device's camera delivers {} of 8 bits", name,
            picture.channels(), picture.elemSize1() * 8, channels);
  }
  BlockPicture out;
  out.file = name;
  const cv::Size size(picture.cols / block_px, picture.rows / block_px);
  out.mean = cv::Mat::zeros(size, CV_64FC(channels));
  out.usable = cv::Mat(size, CV_8UC(channels), cv::Scalar::all(255));
  std::vector<std::int64_t> white(static_cast<std::size_t>(channels), 0);
  for (int v = 0; v < picture.rows; ++v) {
    const auto* in = picture.ptr<std::uint8_t>(v);
    for (int u = 0; u < picture.cols; ++u) {
      for (int c = 0; c < channels; ++c, ++in) {
        const int at = channels * (u / block_px) + c;
        out.mean.ptr<double>(v / block_px)[at] += *in / static_cast<double>(block_px * block_px);
        if (is_white(*in)) {
          ++white[static_cast<std::size_t>(c)];
          out.usable.ptr<std::uint8_t>(v / block_px)[at] = 0;
        }
      }
    }
  }
  for (int v = 0; v < size.height; ++v) {
    for (int i = 0; i < channels * size.width; ++i) {
      if (out.mean.ptr<double>(v)[i] < kBlack) out.usable.ptr<std::uint8_t>(v)[i] = 0;
    }
  }
  for (int c = 0; c < channels; ++c) {
    const double share = static_cast<double>(white[static_cast<std::size_t>(c)]) / static_cast<double>(picture.total());
    if (share <= kMostWhite) continue;
    static constexpr std::array kNames = {"blue", "green", "red"};
    fail_at(
        where,
        "{}: {:.0f} % of its {} numbers are {} or more of 255, which says nothing of the light; allowed are {:.0f} %: "
        "expose less",
        name, 100.0 * share, channels == 3 ? kNames[static_cast<std::size_t>(c)] : "grey", kWhite, 100.0 * kMostWhite);
  }
  return out;
}

BlockPicture read_block_picture(const std::filesystem::path& file, const sim::CameraSpec& camera, int block_px,
                                const SourceLocation& where) {
  return block_picture(sim::read_image(file), file.string(), camera, block_px, where);
}

BlockPicture mean_picture(const std::vector<BlockPicture>& pictures) {
  TS_ASSERT(!pictures.empty());
  BlockPicture out = pictures.front();
  out.mean = out.mean.clone();
  out.usable = out.usable.clone();
  for (std::size_t i = 1; i < pictures.size(); ++i) {
    out.mean += pictures[i].mean;
    out.usable &= pictures[i].usable;
  }
  out.mean /= static_cast<double>(pictures.size());
  out.exposures = static_cast<int>(pictures.size());
  return out;
}

cv::Mat mean_numbers(const cv::Mat& light, const render::Imager& imager) {
  const std::vector<Channel> channels = channels_of(imager);
  const auto count = static_cast<int>(channels.size());
  cv::Mat exact;
  light.convertTo(exact, CV_64F);
  const int bands = exact.channels();
  TS_ASSERT(bands == imager.wavelengths_nm.size());
  cv::Mat numbers(light.size(), CV_64FC(count));
  for (int v = 0; v < light.rows; ++v) {
    const double* in = exact.ptr<double>(v);
    double* out = numbers.ptr<double>(v);
    for (int u = 0; u < light.cols; ++u, in += bands, out += count) {
      for (int c = 0; c < count; ++c) {
        const Channel& channel = channels[static_cast<std::size_t>(c)];
        double electrons = channel.dark_e;
        for (int b = 0; b < bands; ++b) electrons += channel.electrons_per_light[b] * in[b];
        const double linear = std::max(0.0, channel.number_per_e * electrons);
        out[place_of(c, count)] = kFullScale * render::delivered(imager.tone_curve, linear / kFullScale);
      }
    }
  }
  return numbers;
}

namespace {

/// The number before the tone curve, and how much what is delivered changes with it.
struct LinearNumber {
  double number = 0.0, slope = 1.0;
};

LinearNumber linear_number(const render::ToneCurve& curve, double delivered) {
  if (std::holds_alternative<render::LinearTone>(curve)) return {delivered, 1.0};
  constexpr double kStep = 1e-4;  // of full scale: less than a number, more than what is lost to rounding
  const double linear = render::linear_of(curve, delivered / kFullScale);
  const double low = std::max(0.0, linear - kStep);
  const double rise = render::delivered(curve, linear + kStep) - render::delivered(curve, low);
  return {kFullScale * linear, rise / (linear + kStep - low)};
}

}  // namespace

cv::Mat block_noise(const cv::Mat& numbers, const render::Imager& imager, int block_px, int exposures) {
  const std::vector<Channel> channels = channels_of(imager);
  const auto count = static_cast<int>(channels.size());
  cv::Mat noise(numbers.size(), CV_64FC(count));
  for (int v = 0; v < numbers.rows; ++v) {
    const double* in = numbers.ptr<double>(v);
    double* out = noise.ptr<double>(v);
    for (int u = 0; u < numbers.cols; ++u, in += count, out += count) {
      for (int c = 0; c < count; ++c) {
        const Channel& channel = channels[static_cast<std::size_t>(c)];
        const int at = place_of(c, count);
        const LinearNumber shown = linear_number(imager.tone_curve, in[at]);
        const double electrons = std::max(0.0, shown.number / channel.number_per_e);
        const double moving = electrons + channel.read_e * channel.read_e;
        const double still = std::pow(channel.prnu * electrons, 2) + channel.dsnu_e * channel.dsnu_e;
        const double per_e = shown.slope * channel.number_per_e;
        const double step = shown.slope * channel.step;
        const double rounding = step * step / 12.0 + (step != 1.0 ? 1.0 / 12.0 : 0.0);
        const double per_sample = (per_e * per_e * moving + rounding) / exposures + per_e * per_e * still;
        out[at] = std::sqrt(per_sample / (channel.samples * block_px * block_px));
      }
    }
  }
  return noise;
}

sim::DeviceSpec with_block_camera(sim::DeviceSpec device, int block_px) {
  // They would make up for what is wrong with the device's own light.
  device.background = cv::Mat();
  device.residual = nullptr;
  sim::CameraSpec& camera = device.camera.value();
  camera.width /= block_px;
  camera.height /= block_px;
  camera.pixel_pitch_um *= block_px;
  auto* lens = std::get_if<sim::LensSpec>(&camera.optics);
  if (lens && lens->camera_matrix) {  // whose first pixel's centre is at 0
    Eigen::Vector4d& matrix = *lens->camera_matrix;
    matrix.head<2>() /= block_px;
    matrix.tail<2>() = (matrix.tail<2>().array() + 0.5) / block_px - 0.5;
  }
  return device;
}

}  // namespace touchstone::lab
