#include "core/matrix_file.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>

#include "core/error.h"
#include "core/sha256.h"

namespace touchstone {
namespace {

static_assert(std::endian::native == std::endian::little);
constexpr std::size_t kDigestSize = 64;

}  // namespace

std::string matrix_file(std::string_view mark, const std::string& key, std::initializer_list<Eigen::MatrixXd> matrices,
                        std::string_view rest) {
  TS_ASSERT(key.size() == kDigestSize);
  std::string bytes(mark);
  bytes += key;
  for (const Eigen::MatrixXd& matrix : matrices) {
    const std::int64_t size[2] = {matrix.rows(), matrix.cols()};
    bytes.append(reinterpret_cast<const char*>(size), sizeof(size));
    bytes.append(reinterpret_cast<const char*>(matrix.data()),
                 sizeof(double) * static_cast<std::size_t>(matrix.size()));
  }
  bytes += rest;
  return bytes + sha256_of(bytes);
}

MatrixFile::MatrixFile(std::string_view bytes, std::string_view mark, std::string_view what, const std::string& key,
                       std::string_view whose) {
  if (bytes.size() < mark.size() + 2 * kDigestSize) fail("it ends early");
  if (!bytes.starts_with(mark)) fail("it isn't {}", what);
  const std::string_view sealed = bytes.substr(0, bytes.size() - kDigestSize);
  if (sha256_of(sealed) != bytes.substr(sealed.size())) fail("its checksum is wrong");
  rest_ = sealed.substr(mark.size());
  if (!rest_.starts_with(key)) fail("it belongs to another {}", whose);
  rest_.remove_prefix(kDigestSize);
  most_side_ = static_cast<std::int64_t>(bytes.size() / sizeof(double));
}

Eigen::MatrixXd MatrixFile::take() {
  std::int64_t size[2];
  if (rest_.size() < sizeof(size)) fail("it ends early");
  std::memcpy(size, rest_.data(), sizeof(size));
  rest_.remove_prefix(sizeof(size));
  const std::size_t numbers = rest_.size() / sizeof(double);
  // Also a matrix of nothing has sides: who goes through 2^60 empty columns never comes back.
  if (size[0] < 0 || size[1] < 0 || std::max(size[0], size[1]) > most_side_ ||
      (size[1] > 0 && static_cast<std::size_t>(size[0]) > numbers / static_cast<std::size_t>(size[1]))) {
    fail("it ends early");
  }
  Eigen::MatrixXd matrix(size[0], size[1]);
  const std::size_t length = sizeof(double) * static_cast<std::size_t>(matrix.size());
  if (length > 0) std::memcpy(matrix.data(), rest_.data(), length);
  rest_.remove_prefix(length);
  return matrix;
}

}  // namespace touchstone
