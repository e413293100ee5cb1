#include "core/exact_sign.h"

#include <cmath>
#include <limits>
#include <vector>

namespace touchstone {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon() / 2.0;  // largest relative rounding error

// A sum of doubles that don't overlap, smallest first: together they are one number without rounding.
using Expansion = std::vector<double>;

void two_sum(double a, double b, double& sum, double& error) {
  sum = a + b;
  const double b_part = sum - a;
  const double a_part = sum - b_part;
  error = (a - a_part) + (b - b_part);
}

void add(Expansion& sum, double value) {
  Expansion result;
  result.reserve(sum.size() + 1);
  for (const double part : sum) {
    double error = 0.0;
    two_sum(value, part, value, error);
    if (error != 0.0) result.push_back(error);
  }
  if (value != 0.0) result.push_back(value);
  sum = std::move(result);
}

Expansion difference(double a, double b) {
  Expansion result;
  double value = 0.0;
  double error = 0.0;
  two_sum(a, -b, value, error);
  if (error != 0.0) result.push_back(error);
  if (value != 0.0) result.push_back(value);
  return result;
}

Expansion product(const Expansion& x, const Expansion& y) {
  Expansion result;
  for (const double a : x) {
    for (const double b : y) {
      const double high = a * b;
      add(result, std::fma(a, b, -high));
      add(result, high);
    }
  }
  return result;
}

Expansion sum(Expansion x, const Expansion& y, double sign) {
  for (const double part : y) add(x, sign * part);
  return x;
}

int sign_of(double value) {
  return (value > 0.0) - (value < 0.0);
}

// The largest part is the last one, and outweighs all the others together.
int sign_of(const Expansion& value) {
  return value.empty() ? 0 : sign_of(value.back());
}

Expansion cross(const Expansion& ax, const Expansion& ay, const Expansion& bx, const Expansion& by) {
  return sum(product(ax, by), product(ay, bx), -1.0);
}

}  // namespace

int side_of_plane(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                  const Eigen::Vector3d& d) {
  const Eigen::Vector3d ad = a - d;
  const Eigen::Vector3d bd = b - d;
  const Eigen::Vector3d cd = c - d;
  const double x1 = bd.x() * cd.y();
  const double x2 = cd.x() * bd.y();
  const double y1 = cd.x() * ad.y();
  const double y2 = ad.x() * cd.y();
  const double z1 = ad.x() * bd.y();
  const double z2 = bd.x() * ad.y();
  const double determinant = ad.z() * (x1 - x2) + bd.z() * (y1 - y2) + cd.z() * (z1 - z2);
  const double size = (std::abs(x1) + std::abs(x2)) * std::abs(ad.z()) +
                      (std::abs(y1) + std::abs(y2)) * std::abs(bd.z()) +
                      (std::abs(z1) + std::abs(z2)) * std::abs(cd.z());
  const double doubt = (7.0 + 56.0 * kEpsilon) * kEpsilon * size;
  if (std::abs(determinant) > doubt) return sign_of(determinant);
  if (size == 0.0) return 0;  // a whole column or all products are exactly 0

  const Expansion adx = difference(a.x(), d.x());
  const Expansion ady = difference(a.y(), d.y());
  const Expansion bdx = difference(b.x(), d.x());
  const Expansion bdy = difference(b.y(), d.y());
  const Expansion cdx = difference(c.x(), d.x());
  const Expansion cdy = difference(c.y(), d.y());
  Expansion exact = product(cross(bdx, bdy, cdx, cdy), difference(a.z(), d.z()));
  exact = sum(std::move(exact), product(cross(cdx, cdy, adx, ady), difference(b.z(), d.z())), 1.0);
  exact = sum(std::move(exact), product(cross(adx, ady, bdx, bdy), difference(c.z(), d.z())), 1.0);
  return sign_of(exact);
}

int side_of_line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  const double left = (a.x() - c.x()) * (b.y() - c.y());
  const double right = (a.y() - c.y()) * (b.x() - c.x());
  const double determinant = left - right;
  const double size = std::abs(left) + std::abs(right);
  if (std::abs(determinant) > (3.0 + 16.0 * kEpsilon) * kEpsilon * size) return sign_of(determinant);
  if (size == 0.0) return 0;
  return sign_of(
      cross(difference(a.x(), c.x()), difference(a.y(), c.y()), difference(b.x(), c.x()), difference(b.y(), c.y())));
}

}  // namespace touchstone
