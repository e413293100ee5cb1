#include "sim/sensor/traced_slab.h"

#include <Eigen/Core>
#include <cmath>
#include <iterator>
#include <string_view>
#include <system_error>

#include "core/error.h"
#include "core/matrix_file.h"
#include "core/whole_file.h"
#include "sim/sensor/light_file.h"

namespace touchstone::sim {
namespace {

constexpr std::string_view kMark = "TSMILKY1";
constexpr double kMostPixels = 1e9;  // that an error is measured on

}  // namespace

void write_traced(const std::filesystem::path& folder, const std::string& key, const TracedSlab& traced) {
  const Eigen::Index width = Eigen::Index{traced.rest.cols} * traced.rest.channels();
  Eigen::MatrixXd rest(width, traced.rest.rows);
  for (int j = 0; j < traced.rest.rows; ++j) {
    rest.col(j) = Eigen::Map<const Eigen::VectorXf>(traced.rest.ptr<float>(j), width).cast<double>();
  }
  Eigen::MatrixXd shares(std::size(kFlatStates), traced.shares.size());
  for (std::size_t b = 0; b < traced.shares.size(); ++b) {
    shares.col(static_cast<Eigen::Index>(b)) =
        Eigen::Map<const Eigen::VectorXd>(traced.shares[b].data(), shares.rows());
  }
  Eigen::MatrixXd error(5, 1);
  error << traced.error.rms, traced.error.rms_error, traced.error.mean, traced.error.mean_error, traced.error.pixels;
  write_whole_file(light_file(folder, key), matrix_file(kMark, key, {rest, shares, error}));
}

std::optional<TracedSlab> read_traced(const std::filesystem::path& folder, const std::string& key) {
  const std::filesystem::path file = light_file(folder, key);
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) return std::nullopt;
  try {
    const std::string content = read_whole_file(file);
    MatrixFile matrices(content, kMark, "a milky slab's light", key, "sensor");
    const Eigen::MatrixXd rest = matrices.take();
    const Eigen::MatrixXd shares = matrices.take();
    const Eigen::MatrixXd error = matrices.take();
    const auto bands = static_cast<int>(shares.cols());
    if (bands < 1 || rest.rows() % bands != 0 || shares.rows() != static_cast<Eigen::Index>(std::size(kFlatStates)) ||
        error.size() != 5 || !rest.allFinite() || !shares.allFinite() || !error.allFinite() ||
        std::abs(error(4)) > kMostPixels || bands > CV_CN_MAX) {
      return std::nullopt;
    }
    TracedSlab traced;
    traced.rest.create(static_cast<int>(rest.cols()), static_cast<int>(rest.rows()) / bands, CV_32FC(bands));
    for (Eigen::Index j = 0; j < rest.cols(); ++j) {
      auto* to = traced.rest.ptr<float>(static_cast<int>(j));
      for (Eigen::Index i = 0; i < rest.rows(); ++i) to[i] = static_cast<float>(rest(i, j));
    }
    for (int b = 0; b < bands; ++b) {
      traced.shares.emplace_back(shares.col(b).data(), shares.col(b).data() + shares.rows());
    }
    traced.error = {error(0), error(1), error(2), error(3), static_cast<int>(error(4))};
    return traced;
  } catch (const Error&) {
    return std::nullopt;  // it's made anew, and the file replaced
  }
}

}  // namespace touchstone::sim
