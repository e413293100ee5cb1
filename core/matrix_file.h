#pragma once
// Matrices that belong to a key, as the bytes of a cached file with a checksum.
//
// The bytes are: a mark of 8 letters, the key (64 hexadecimal digits), the matrices, what follows them, and the SHA-256
// of all before it (64 hexadecimal digits). A matrix is its rows and columns (int64) and its numbers by columns,
// little-endian.

#include <Eigen/Core>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>

namespace touchstone {

/// @pre the key is a SHA-256 in hexadecimal digits
std::string matrix_file(std::string_view mark, const std::string& key, std::initializer_list<Eigen::MatrixXd> matrices,
                        std::string_view rest = {});

/// Reads such bytes from their begin on. The bytes must outlive it.
class MatrixFile {
 public:
  /// `what` and `whose` end the refusals "it isn't ..." and "it belongs to another ...".
  /// @throws Error that says, as the second half of a sentence, why the file can't be used
  MatrixFile(std::string_view bytes, std::string_view mark, std::string_view what, const std::string& key,
             std::string_view whose);

  /// The next matrix. @throws Error "it ends early"
  Eigen::MatrixXd take();
  /// What follows the matrices taken.
  std::string_view rest() const { return rest_; }

 private:
  std::string_view rest_;
  std::int64_t most_side_ = 0;
};

}  // namespace touchstone
