#include "datasets/inspection/page_parts.h"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <algorithm>

#include "core/error.h"
#include "plots/line_plot.h"
#include "render/imager/jpeg.h"

namespace touchstone::datasets {
namespace {

constexpr int kJpegQuality = 90;

constexpr const char* kPageStyle = R"(
body { font-family: sans-serif; margin: 2em auto; max-width: 82em; padding: 0 1em; color: #222; background: #fff; }
h1 { margin-bottom: 0.2em; } h2 { margin-top: 1.6em; border-bottom: 1px solid #ccc; }
table { border-collapse: collapse; font-size: 0.9em; margin: 0.6em 0; }
th, td { text-align: left; padding: 0.25em 0.7em; border-bottom: 1px solid #ddd; vertical-align: top; }
th { border-bottom: 2px solid #888; }
td.number { text-align: right; font-variant-numeric: tabular-nums; }
td:first-child { white-space: nowrap; }
.wide { overflow-x: auto; }
tr.off { color: #777; }
img, svg { max-width: 100%; height: auto; }
figure { display: inline-block; margin: 0.4em; vertical-align: top; } figcaption { font-size: 0.85em; }
.plots { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(100%, 30em), 1fr)); }
#view { width: 100%; height: 32em; background: #eef; }
pre { background: #f6f6f6; padding: 0.8em; overflow-x: auto; font-size: 0.85em; }
.note { color: #555; font-size: 0.9em; overflow-wrap: anywhere; }
)";

}  // namespace

std::string base64(const std::string& bytes) {
  std::string text(4 * ((bytes.size() + 2) / 3) + 1, '\0');  // OpenSSL ends it by a zero
  TS_ASSERT(bytes.size() < (std::size_t{1} << 30));
  const int length =
      EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()),
                      reinterpret_cast<const unsigned char*>(bytes.data()), static_cast<int>(bytes.size()));
  text.resize(static_cast<std::size_t>(length));
  return text;
}

std::string picture_element(const cv::Mat& picture, const std::string& caption) {
  const std::string words = plots::escape_markup(caption);
  return fmt::format(
      "<figure><img width=\"{}\" height=\"{}\" alt=\"{}\" src=\"data:image/jpeg;base64,{}\"><figcaption>{}</figcaption>"
      "</figure>\n",
      picture.cols, picture.rows, words, base64(render::jpeg_bytes(picture, {.quality = kJpegQuality})), words);
}

std::string cell(const std::string& text, const char* kind) {
  return fmt::format("<{0}>{1}</{0}>", kind, plots::escape_markup(text));
}

std::string number_cell(double value) {
  return fmt::format("<td class=\"number\">{:.4g}</td>", value);
}

std::string table(const std::vector<std::string>& head, const std::string& rows) {
  std::string html = "<div class=\"wide\"><table>";
  if (!head.empty()) {
    html += "<tr>";
    for (const std::string& name : head) html += cell(name, "th");
    html += "</tr>\n";
  }
  return html + rows + "</table></div>\n";
}

std::vector<std::size_t> spread_over(std::size_t first, std::size_t size, std::size_t count) {
  std::vector<std::size_t> chosen;
  count = std::min(size, count);
  for (std::size_t i = 0; i < count; ++i) {
    chosen.push_back(first + (count == 1 ? size - 1 : i * (size - 1) / (count - 1)));
  }
  return chosen;
}

std::string page_begin(const std::string& title) {
  const std::string words = plots::escape_markup(title);
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" "
         "content=\"width=device-width\">\n<title>" +
         words + "</title>\n<style>" + kPageStyle +
         "</style>\n<link rel=\"icon\" href=\"data:,\">\n</head>\n<body>\n<h1>" + words + "</h1>\n";
}

std::string page_end() {
  return "</body>\n</html>\n";
}

}  // namespace touchstone::datasets
