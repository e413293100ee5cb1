#include "lab/bench/body_meshes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "core/error.h"

namespace touchstone::lab {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Rows from the top, cells from the left.
struct Glyph {
  char letter;
  std::array<const char*, 7> rows;
};

constexpr std::array<Glyph, 9> kGlyphs = {{
    {'E', {"#####", "#....", "#....", "####.", "#....", "#....", "#####"}},
    {'F', {"#####", "#....", "#....", "####.", "#....", "#....", "#...."}},
    {'H', {"#...#", "#...#", "#...#", "#####", "#...#", "#...#", "#...#"}},
    {'I', {"..#..", "..#..", "..#..", "..#..", "..#..", "..#..", "..#.."}},
    {'L', {"#....", "#....", "#....", "#....", "#....", "#....", "#####"}},
    {'O', {"#####", "#...#", "#...#", "#...#", "#...#", "#...#", "#####"}},
    {'P', {"#####", "#...#", "#...#", "#####", "#....", "#....", "#...."}},
    {'T', {"#####", "..#..", "..#..", "..#..", "..#..", "..#..", "..#.."}},
    {'U', {"#...#", "#...#", "#...#", "#...#", "#...#", "#...#", "#####"}},
}};

/// Lines of `count` stripes and the gaps beside them, centred.
std::vector<double> stripes(int count, double width, double pitch) {
  std::vector<double> lines;
  const double first = -0.5 * (count - 1) * pitch;
  const double gap = pitch - width;
  lines.push_back(first - 0.5 * width - 0.5 * gap);
  for (int k = 0; k < count; ++k) {
    lines.push_back(first + k * pitch - 0.5 * width);
    lines.push_back(first + k * pitch + 0.5 * width);
  }
  lines.push_back(-lines.front());
  return lines;
}

/// Vertices that are asked for by what they are, each made once.
class SharedVertices {
 public:
  explicit SharedVertices(TriangleMesh& mesh) : mesh_(mesh) {}

  int at(const std::array<int, 3>& name, const Vector3d& place) {
    const auto [found, made] = known_.try_emplace(name, static_cast<int>(mesh_.vertices.size()));
    if (made) mesh_.vertices.push_back(place);
    return found->second;
  }

 private:
  TriangleMesh& mesh_;
  std::map<std::array<int, 3>, int> known_;
};

void add_quad(TriangleMesh& mesh, int a, int b, int c, int d) {
  mesh.triangles.push_back({a, b, c});
  mesh.triangles.push_back({a, c, d});
}

}  // namespace

TriangleMesh pattern_on_plate(const std::vector<double>& x, const std::vector<double>& y,
                              const std::vector<bool>& raised, double height, double plate) {
  const int nx = static_cast<int>(x.size()) - 1;
  const int ny = static_cast<int>(y.size()) - 1;
  TS_ASSERT(nx > 0 && ny > 0 && raised.size() == static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny));
  const std::array<double, 3> levels = {0.0, height, height + plate};
  enum Level { low = 0, base = 1, back = 2, beyond = 3 };
  TriangleMesh mesh;
  SharedVertices vertices(mesh);
  const auto vertex = [&](int i, int j, int level) {
    return vertices.at({i, j, level}, {x[i], y[j], levels[static_cast<std::size_t>(level)]});
  };
  // Where a cell's lower face lies; beside the plate there is nothing.
  const auto level_of = [&](int i, int j) {
    if (i < 0 || j < 0 || i >= nx || j >= ny) return static_cast<int>(beyond);
    return static_cast<int>(
        raised[static_cast<std::size_t>(j) * static_cast<std::size_t>(nx) + static_cast<std::size_t>(i)] ? low : base);
  };
  // The wall over a line from a to b that has the deeper cell on its left, seen from above.
  const auto wall = [&](std::array<int, 2> a, std::array<int, 2> b, int from, int to) {
    for (int level = from; level < std::min<int>(to, back); ++level) {
      add_quad(mesh, vertex(a[0], a[1], level), vertex(b[0], b[1], level), vertex(b[0], b[1], level + 1),
               vertex(a[0], a[1], level + 1));
    }
  };
  for (int j = 0; j < ny; ++j) {
    for (int i = 0; i < nx; ++i) {
      const int level = level_of(i, j);
      add_quad(mesh, vertex(i, j, level), vertex(i, j + 1, level), vertex(i + 1, j + 1, level),
               vertex(i + 1, j, level));
      add_quad(mesh, vertex(i, j, back), vertex(i + 1, j, back), vertex(i + 1, j + 1, back), vertex(i, j + 1, back));
      wall({i, j}, {i + 1, j}, level, level_of(i, j - 1));
      wall({i + 1, j}, {i + 1, j + 1}, level, level_of(i + 1, j));
      wall({i + 1, j + 1}, {i, j + 1}, level, level_of(i, j + 1));
      wall({i, j + 1}, {i, j}, level, level_of(i - 1, j));
    }
  }
  return mesh;
}

const std::string& letters_known() {
  static const std::string letters = [] {
    std::string all;
    for (const Glyph& glyph : kGlyphs) all += glyph.letter;
    return all;
  }();
  return letters;
}

TriangleMesh letter_on_plate(char letter, double stroke, double height, double plate) {
  const auto* glyph = std::find_if(kGlyphs.begin(), kGlyphs.end(), [&](const Glyph& g) { return g.letter == letter; });
  TS_ASSERT(glyph != kGlyphs.end());
  std::vector<double> x;
  std::vector<double> y;
  for (int i = 0; i <= 7; ++i) x.push_back((i - 3.5) * stroke);
  for (int j = 0; j <= 9; ++j) y.push_back((j - 4.5) * stroke);
  std::vector<bool> raised(7 * 9, false);
  for (std::size_t row = 0; row < 7; ++row) {
    for (std::size_t column = 0; column < 5; ++column) {
      raised[(7 - row) * 7 + column + 1] = glyph->rows[row][column] == '#';
    }
  }
  return pattern_on_plate(x, y, raised, height, plate);
}

TriangleMesh studs_on_plate(int count, double width, double pitch, double height, double plate) {
  const std::vector<double> lines = stripes(count, width, pitch);
  const std::size_t cells = lines.size() - 1;
  std::vector<bool> raised(cells * cells, false);
  for (std::size_t j = 1; j < cells; j += 2) {
    for (std::size_t i = 1; i < cells; i += 2) raised[j * cells + i] = true;
  }
  return pattern_on_plate(lines, lines, raised, height, plate);
}

TriangleMesh ridges_on_plate(int count, double width, double pitch, double length, double height, double plate) {
  const std::vector<double> lines = stripes(count, width, pitch);
  std::vector<bool> raised(lines.size() - 1, false);
  for (std::size_t i = 1; i < raised.size(); i += 2) raised[i] = true;
  return pattern_on_plate(lines, {-0.5 * length, 0.5 * length}, raised, height, plate);
}

TriangleMesh turned_profile(const std::vector<Vector2d>& profile, int sides,
                            const std::function<double(int point, int step)>& stretch) {
  const int points = static_cast<int>(profile.size());
  TS_ASSERT(points >= 3 && sides >= 3);
  const bool open = profile.front().x() == 0.0 && profile.back().x() == 0.0;
  TriangleMesh mesh;
  SharedVertices vertices(mesh);
  const auto vertex = [&](int point, int step) {
    const Vector2d& p = profile[static_cast<std::size_t>(point)];
    step %= sides;
    const int name = p.x() == 0.0 ? 0 : step;  // on the axis all are one
    const double angle = std::numbers::pi * (2 * step + 1) / sides;
    const double radius = p.x() * (stretch ? stretch(point, step) : 1.0);
    return vertices.at({point, name, 0}, {radius * std::cos(angle), radius * std::sin(angle), p.y()});
  };
  for (int k = 0; k < (open ? points - 1 : points); ++k) {
    const int next = (k + 1) % points;
    for (int step = 0; step < sides; ++step) {
      const std::array<int, 4> corner = {vertex(k, step), vertex(k, step + 1), vertex(next, step + 1),
                                         vertex(next, step)};
      if (corner[0] != corner[1]) mesh.triangles.push_back({corner[0], corner[1], corner[2]});
      if (corner[2] != corner[3]) mesh.triangles.push_back({corner[0], corner[2], corner[3]});
    }
  }
  return mesh;
}

TriangleMesh threaded_rod(double radius, double pitch, int turns) {
  constexpr int kAround = 64;
  constexpr int kPerPitch = 16;
  const double depth = 0.625 * std::sqrt(0.75) * pitch;
  const int along = turns * kPerPitch;
  TriangleMesh mesh;
  SharedVertices vertices(mesh);
  // Depth below the crest at a part of the pitch: crest, flank, root, flank.
  const auto below_crest = [&](double part) {
    const double from_crest = std::abs(part - std::floor(part) - 0.5);  // 0.5 at the crest's middle, 0 at the root's
    return depth * std::clamp((0.5 - from_crest - 0.0625) / (0.5 - 0.0625 - 0.125), 0.0, 1.0);
  };
  const auto place = [&](int i, int k) {
    const double x = pitch * (static_cast<double>(i) / kPerPitch - 0.5 * turns);
    const double angle = 2.0 * std::numbers::pi * k / kAround;
    const double r = radius - below_crest(static_cast<double>(i) / kPerPitch - static_cast<double>(k) / kAround);
    return Vector3d(x, r * std::sin(angle), radius - r * std::cos(angle));
  };
  const auto vertex = [&](int i, int k) { return vertices.at({i, k % kAround, 0}, place(i, k % kAround)); };
  for (int k = 0; k < kAround; ++k) {
    for (int i = 0; i < along; ++i) {
      add_quad(mesh, vertex(i, k), vertex(i, k + 1), vertex(i + 1, k + 1), vertex(i + 1, k));
    }
  }
  for (const int end : {0, along}) {
    const int middle = vertices.at({end, 0, 1}, {place(end, 0).x(), 0.0, radius});
    for (int k = 0; k < kAround; ++k) {
      const int a = vertex(end, end == 0 ? k + 1 : k);
      const int b = vertex(end, end == 0 ? k : k + 1);
      mesh.triangles.push_back({middle, a, b});
    }
  }
  return mesh;
}

}  // namespace touchstone::lab
