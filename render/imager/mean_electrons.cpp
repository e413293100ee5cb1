#include "render/imager/mean_electrons.h"

#include <opencv2/core.hpp>

namespace touchstone::render {

std::vector<ImagerResponse> channel_responses(const Imager& imager) {
  std::vector<ImagerResponse> responses;
  for (int c = 0; c < static_cast<int>(imager.quantum_efficiency.rows()); ++c) {
    responses.push_back(response_of(channel_imager(imager, c)));
  }
  return responses;
}

cv::Mat mean_electrons(const cv::Mat& irradiance, const std::vector<ImagerResponse>& channels) {
  std::vector<cv::Mat> bands;
  cv::split(irradiance, bands);
  std::vector<cv::Mat> electrons;
  for (const ImagerResponse& response : channels) {
    cv::Mat sum = cv::Mat::zeros(irradiance.size(), CV_32F);
    for (std::size_t b = 0; b < bands.size(); ++b) {
      sum += bands[b] * response.electrons_per_irradiance(0, static_cast<Eigen::Index>(b));
    }
    electrons.push_back(sum);
  }
  cv::Mat all;
  cv::merge(electrons, all);
  return all;
}

}  // namespace touchstone::render
