#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace touchstone {

/// SHA-256 over what is added, piece by piece (OpenSSL's). The digest is 64 hexadecimal digits.
class Sha256 {
 public:
  Sha256();
  ~Sha256();
  Sha256(const Sha256&) = delete;
  Sha256& operator=(const Sha256&) = delete;

  /// Hashes these bytes behind those before them.
  void add(const void* bytes, std::size_t size);
  void add(std::string_view text);
  /// Ends the sum. Nothing can be added afterwards.
  std::string digest();

 private:
  struct Context;
  std::unique_ptr<Context> context_;
};

/// Of these bytes, as 64 hexadecimal digits in small letters.
std::string sha256_of(std::string_view bytes);
/// @throws Error if the file can't be read or is no file (core/input_file.h)
std::string sha256_of_file(const std::filesystem::path& path);

}  // namespace touchstone
