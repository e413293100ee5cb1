#include "render/spectra/spectral_bands.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"

namespace touchstone::render {
namespace {

constexpr double kSampleNm = 1.0;      // of the curves, for errors and weighted means
constexpr int kSamplesAnEdgeStep = 2;  // edges are tried at every second sample

/// Wavelengths in the middles of equal steps of at most kSampleNm, a multiple of `parts` of them.
std::vector<double> samples_of(double from_nm, double to_nm, int parts = 1) {
  const int steps = parts * std::max(1, static_cast<int>(std::ceil((to_nm - from_nm) / (kSampleNm * parts))));
  std::vector<double> at;
  for (int k = 0; k < steps; ++k) at.push_back(from_nm + (k + 0.5) * (to_nm - from_nm) / steps);
  return at;
}

/// Sums from the first sample to before the k-th, so that a band's sum is a difference.
class RunningSum {
 public:
  explicit RunningSum(const std::vector<double>& values) : sums_(values.size() + 1, 0.0) {
    for (std::size_t k = 0; k < values.size(); ++k) sums_[k + 1] = sums_[k] + values[k];
  }
  double between(std::size_t first, std::size_t last) const { return sums_[last] - sums_[first]; }

 private:
  std::vector<double> sums_;
};

/// A path at samples of the range, ready to give any band's error.
class SampledPath {
 public:
  SampledPath(const SpectralPath& path, const std::optional<SpectralCurve>& weight, const std::vector<double>& at)
      : emitted_(sampled(at, [&](double nm) { return emitted_at(path.emission, nm); })),
        arrived_(sampled(at,
                         [&](double nm) {
                           double light = emitted_at(path.emission, nm);
                           for (const SpectralCurve& factor : path.factors) light *= factor.at(nm);
                           return light;
                         })),
        weight_(sampled(at, [&](double nm) { return weight ? emitted_at(*weight, nm) : 1.0; })),
        samples_(at.size()) {
    for (const SpectralCurve& factor : path.factors) {
      weighted_.push_back(
          sampled(at, [&](double nm) { return factor.at(nm) * (weight ? emitted_at(*weight, nm) : 1.0); }));
      plain_.push_back(sampled(at, [&](double nm) { return factor.at(nm); }));
    }
  }

  double exact() const { return arrived_.between(0, samples_); }

  /// |approximate - exact| of the band that the samples make up.
  double error(std::size_t first, std::size_t last) const {
    double light = emitted_.between(first, last);
    const double weight = weight_.between(first, last);
    const auto count = static_cast<double>(last - first);
    for (std::size_t k = 0; k < weighted_.size(); ++k) {
      light *= weight > 0.0 ? weighted_[k].between(first, last) / weight : plain_[k].between(first, last) / count;
    }
    return std::abs(light - arrived_.between(first, last));
  }

 private:
  template <typename Function>
  static RunningSum sampled(const std::vector<double>& at, const Function& function) {
    std::vector<double> values;
    for (const double nm : at) values.push_back(function(nm));
    return RunningSum(values);
  }

  RunningSum emitted_, arrived_, weight_;
  std::vector<RunningSum> weighted_, plain_;  // one a factor
  std::size_t samples_;
};

}  // namespace

Spectrum SpectralBands::centres_nm() const {
  Spectrum centres(count());
  for (int k = 0; k < count(); ++k) {
    const double from = edges_nm[static_cast<std::size_t>(k)];
    const double to = edges_nm[static_cast<std::size_t>(k) + 1];
    double sum = 0.0;
    double moment = 0.0;
    if (weight) {
      for (const double at : samples_of(from, to)) {
        sum += emitted_at(*weight, at);
        moment += at * emitted_at(*weight, at);
      }
    }
    centres[k] = sum > 0.0 ? moment / sum : 0.5 * (from + to);
  }
  return centres;
}

SpectralBands even_bands(double from_nm, double to_nm, int count) {
  if (!(from_nm > 0.0 && to_nm > from_nm && std::isfinite(to_nm))) {
    fail("spectral bands from {} to {} nm; they must lie above 0 and rise", from_nm, to_nm);
  }
  if (count < 1 || count > kMaxBands) fail("{} spectral bands; 1 to {} are allowed", count, kMaxBands);
  SpectralBands bands;
  for (int k = 0; k <= count; ++k) bands.edges_nm.push_back(from_nm + (to_nm - from_nm) * k / count);
  return bands;
}

Spectrum band_means(const SpectralCurve& curve, const SpectralBands& bands) {
  Spectrum means(bands.count());
  for (int k = 0; k < bands.count(); ++k) {
    const double from = bands.edges_nm[static_cast<std::size_t>(k)];
    const double to = bands.edges_nm[static_cast<std::size_t>(k) + 1];
    double sum = 0.0;
    double weighted = 0.0;
    if (bands.weight) {
      for (const double at : samples_of(from, to)) {
        sum += emitted_at(*bands.weight, at);
        weighted += curve.at(at) * emitted_at(*bands.weight, at);
      }
    }
    means[k] = sum > 0.0 ? weighted / sum : curve.mean(from, to);
  }
  return means;
}

Spectrum band_powers(const SpectralCurve& emission, double power_W, const SpectralBands& bands) {
  const double first = emission.wavelengths_nm.front();
  const double last = emission.wavelengths_nm.back();
  const double all = emission.integral(first, last);
  Spectrum powers(bands.count());
  for (int k = 0; k < bands.count(); ++k) {
    const double from = std::clamp(bands.edges_nm[static_cast<std::size_t>(k)], first, last);
    const double to = std::clamp(bands.edges_nm[static_cast<std::size_t>(k) + 1], first, last);
    powers[k] = power_W * emission.integral(from, to) / all;
  }
  if (power_W > 0.0 && !(powers.sum() > 0.0)) {
    fail("the bands from {} to {} nm see nothing of a lamp that radiates from {} to {} nm", bands.edges_nm.front(),
         bands.edges_nm.back(), first, last);
  }
  return powers;
}

double band_error(const SpectralPath& path, const SpectralBands& bands) {
  double wrong = 0.0;
  double exact = 0.0;
  for (std::size_t k = 0; k + 1 < bands.edges_nm.size(); ++k) {
    const std::vector<double> at = samples_of(bands.edges_nm[k], bands.edges_nm[k + 1]);
    const SampledPath band(path, bands.weight, at);
    const double width = (bands.edges_nm[k + 1] - bands.edges_nm[k]) / static_cast<double>(at.size());
    wrong += width * band.error(0, at.size());
    exact += width * band.exact();
  }
  return exact > 0.0 ? wrong / exact : 0.0;
}

SpectralBands adapted_bands(std::span<const SpectralPath> paths, const std::optional<SpectralCurve>& weight,
                            double from_nm, double to_nm, int count) {
  SpectralBands bands = even_bands(from_nm, to_nm, count);
  bands.weight = weight;
  const std::vector<double> at = samples_of(from_nm, to_nm, kSamplesAnEdgeStep);
  const std::size_t places = at.size() / kSamplesAnEdgeStep + 1;  // where an edge may be
  if (places < 2 * static_cast<std::size_t>(count) + 1) {
    fail("{} spectral bands from {} to {} nm; each must have some {} nm", count, from_nm, to_nm,
         2 * kSamplesAnEdgeStep * kSampleNm);
  }
  if (count == 1 || paths.empty()) return bands;

  // error[i][j]: of a band from place i to place j > i, summed over the paths, each relative to what arrives of it.
  std::vector<std::vector<double>> error(places, std::vector<double>(places, 0.0));
  for (const SpectralPath& path : paths) {
    const SampledPath sampled(path, weight, at);
    if (!(sampled.exact() > 0.0)) continue;
    for (std::size_t i = 0; i < places; ++i) {
      for (std::size_t j = i + 1; j < places; ++j) {
        error[i][j] += sampled.error(kSamplesAnEdgeStep * i, kSamplesAnEdgeStep * j) / sampled.exact();
      }
    }
  }
  // least[j]: of the first k bands if they end at place j; one more band in each round.
  constexpr double kNever = std::numeric_limits<double>::infinity();
  std::vector<double> least(places, kNever);
  least[0] = 0.0;
  std::vector<std::vector<std::size_t>> begin;  // [round][j]: where the last band begins
  for (int round = 0; round < count; ++round) {
    std::vector<double> next(places, kNever);
    begin.emplace_back(places, 0);
    for (std::size_t j = 1; j < places; ++j) {
      for (std::size_t i = 0; i < j; ++i) {
        if (least[i] + error[i][j] < next[j]) {
          next[j] = least[i] + error[i][j];
          begin.back()[j] = i;
        }
      }
    }
    least = std::move(next);
  }
  std::size_t place = places - 1;
  for (std::size_t band = static_cast<std::size_t>(count) - 1; band > 0; --band) {
    place = begin[band][place];
    bands.edges_nm[band] = from_nm + (to_nm - from_nm) * static_cast<double>(place) / static_cast<double>(places - 1);
  }
  return bands;
}

SpectralBands bands_within(std::span<const SpectralPath> paths, const std::optional<SpectralCurve>& weight,
                           double from_nm, double to_nm, double tolerance, std::span<const int> counts) {
  TS_ASSERT(!counts.empty());
  SpectralBands bands;
  for (const int count : counts) {
    bands = adapted_bands(paths, weight, from_nm, to_nm, count);
    const bool good = std::all_of(paths.begin(), paths.end(),
                                  [&](const SpectralPath& path) { return band_error(path, bands) <= tolerance; });
    if (good) break;
  }
  return bands;
}

}  // namespace touchstone::render
