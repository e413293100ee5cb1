#include "core/sha256.h"

#include <openssl/evp.h>

#include <array>

#include "core/error.h"
#include "core/input_file.h"

namespace touchstone {

struct Sha256::Context {
  EVP_MD_CTX* md = EVP_MD_CTX_new();
  ~Context() { EVP_MD_CTX_free(md); }
};

Sha256::Sha256() : context_(std::make_unique<Context>()) {
  TS_ASSERT(EVP_DigestInit_ex(context_->md, EVP_sha256(), nullptr) == 1);
}

Sha256::~Sha256() = default;

void Sha256::add(const void* bytes, std::size_t size) {
  TS_ASSERT(EVP_DigestUpdate(context_->md, bytes, size) == 1);
}

void Sha256::add(std::string_view text) {
  add(text.data(), text.size());
}

std::string Sha256::digest() {
  std::array<unsigned char, EVP_MAX_MD_SIZE> bytes{};
  unsigned size = 0;
  TS_ASSERT(EVP_DigestFinal_ex(context_->md, bytes.data(), &size) == 1);
  std::string hex;
  for (unsigned i = 0; i < size; ++i) hex += fmt::format("{:02x}", bytes[i]);
  return hex;
}

std::string sha256_of(std::string_view bytes) {
  Sha256 sum;
  sum.add(bytes);
  return sum.digest();
}

std::string sha256_of_file(const std::filesystem::path& path) {
  InputFile file(path);
  Sha256 sum;
  std::array<char, 1 << 16> buffer{};
  while (const std::size_t size = file.read(buffer.data(), buffer.size())) sum.add(buffer.data(), size);
  return sum.digest();
}

}  // namespace touchstone
