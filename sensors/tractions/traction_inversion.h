#pragma once
// From how a gel's markers moved to the tractions that moved them, and so to the force: what [Lin2019] leaves open
// ("IV. suitable means of measuring the force").
//
// Linear: displacement d = A t + noise, A from sensors/tractions/marker_compliance.h. The markers don't determine t by
// themselves: a gel of nu = 0.5 bonded to its plate hardly moves under an even pressure, and what is finer than a
// marker spacing escapes them. So three things are added, in Bayes' terms:
// - Smoothness: tractions are taken for a random field of zero mean, of standard deviation `scale` * E and covariance
//   (1 + r/l) exp(-r/l) (Matern's of order 3/2; l is `correlation` gel thicknesses: forces that differ over less hardly
//   show at the markers). Its inverse is a Tikhonov norm of value and slopes; unlike the energy norm, in which even
//   pressures on a bonded incompressible gel cost next to nothing, it bounds them all.
// - Contact can't pull: p >= 0.
// - Where nothing touches there's no traction. Which patches touch isn't known: the same problem with a short leash
//   (`first_scale`) over all patches gives a first pressure, and its patches above 50, 40, ... 5, 0 % of its
//   maximum are tried, and also no contact at all. That of the highest evidence (the likelihood of the displacements
//   with the tractions integrated out [MacKay1992], for the noise as stated) is taken. Outside of it all tractions are
//   zero, inside the normal ones are at least zero.
// The discrepancy principle, by which the smallest contact that explains the markers would be taken, makes contacts too
// small or too large by more (docs/sensors/chroma-force.md has the figures).
//
// Signs: tractions are those on the gel, wrenches those on the object that touches it (a press has Fz > 0), both in the
// gel frame, as fem::PressState gives them.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/dense_solvers.h"
#include "sensors/markers/marker_field.h"
#include "sensors/tractions/marker_compliance.h"

namespace touchstone::sensors {

/// The noise of what is measured, and what is expected of tractions.
struct TractionSettings {
  double lateral_noise_mm = 0.02;  ///< standard deviation of a marker's displacement along x and along y; above 0
  double normal_noise_mm = 0.06;   ///< likewise along z
  double correlation = 0.45;       ///< of the tractions, gel thicknesses; 0.05 to 5
  double scale = 0.25;             ///< of the tractions, Young's moduli; 0.001 to 100
  double first_scale = 0.05;       ///< likewise, while the contact is sought
};

/// Traction around one marker: its mean over a square of a marker spacing about it.
struct MarkerTraction {
  Eigen::Vector3d traction = Eigen::Vector3d::Zero();    ///< on the gel, MPa: pressure is -z
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< MPa^2; of what is in contact only
  double contact = 0.0;                                  ///< share of the square that is in contact, 0 to 1
};

/// A wrench: force (N), then torque (N mm).
using Vector6d = Eigen::Matrix<double, 6, 1>;
/// Its covariance.
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// The tractions that explain one frame, with what is uncertain about them.
struct TractionField {
  Eigen::Matrix3Xd traction;          ///< on the gel, MPa, a column for each patch
  std::vector<std::uint8_t> contact;  ///< of each patch: 0 or 1
  std::vector<MarkerTraction> markers;
  /// On the object: force (N), torque about the gel frame's origin (N mm). The contact is where the gel has carried it:
  /// patches lie aside from their places at rest by the mean displacement of the measured markers in contact.
  Vector6d wrench = Vector6d::Zero();
  /// Of the patches at rest, mm: it stays while the object sticks, wherever it carries the gel. Zero without contact.
  Eigen::Vector2d centre_of_pressure = Eigen::Vector2d::Zero();
  Matrix6d noise = Matrix6d::Zero();  ///< covariance of the wrench from the stated noise alone, for this contact
  /// Covariance of the wrench with all that is known to be unknown: the noise and what smoothness fills in (the bias to
  /// be expected from it), on the next larger contact that was tried, since the rim isn't known to better than that,
  /// times misfit^2 where the misfit is above 1; and the choice among contacts (their spread, by evidence). Without
  /// contact also the wrench of the likeliest one: a touch too light to be sure of. What the gel does beyond the linear
  /// map isn't in it.
  Matrix6d uncertainty = Matrix6d::Zero();
  bool in_contact = false;  ///< something touches: else all tractions and the wrench are zero
  double misfit = 0.0;      ///< RMS of what isn't explained, over the stated noise and with the degrees of freedom used
                            ///< taken off: about 1 where noise and model are as stated
  int measured = 0;         ///< markers
  int contacts_tried = 0;
  int factorisations = 0;

  double sigma(int component) const;  ///< of the wrench, the root of `uncertainty`'s diagonal
};

/// Turns frames into tractions. Works on what is common to all frames once (and again when other markers are measured
/// than in the frame before: some ten times a frame's work). The same input gives the same bits. One object is for one
/// thread.
class TractionInversion {
 public:
  /// Fewer measured markers than this are refused.
  static constexpr int kLeastMarkers = 9;
  /// More patches than this are refused: their matrices would be too large.
  static constexpr int kMostInverted = 1100;

  /// @throws Error for a faulty or too large compliance (fault_of, kMostInverted), or naming the setting that is out of
  /// its range
  explicit TractionInversion(MarkerCompliance compliance, const TractionSettings& settings = {});

  /// @throws Error for a field of another grid or with lists of a wrong length, if a measured displacement isn't finite
  /// or if fewer than kLeastMarkers are measured
  TractionField invert(const MarkerField& field);

  const MarkerCompliance& compliance() const { return compliance_; }
  const TractionSettings& settings() const { return settings_; }

 private:
  struct Candidate;
  void prepare(const std::vector<std::uint8_t>& measured);
  std::vector<std::vector<int>> possible_contacts(const Eigen::VectorXd& data, int& factorisations) const;
  Candidate solve(const std::vector<int>& patches, const Eigen::VectorXd& load, double data_square) const;
  void describe(const std::vector<Candidate>& tried, std::size_t best, TractionField& result) const;
  void carry(const MarkerField& field, TractionField& result) const;

  MarkerCompliance compliance_;
  TractionSettings settings_;
  Eigen::MatrixXd correlation_;          ///< patches x patches
  Eigen::MatrixXd inverse_correlation_;  ///< its inverse
  Eigen::MatrixXd share_;  ///< markers x patches: of a patch in the square about a marker, over that square's area
  // Rows of A over the noise; their products; and what lateral tractions of the first scale do to the data
  // (covariance). Unknown 3 p + a is the traction on patch p, along z the pressure.
  Eigen::MatrixXd all_weighted_, all_normal_, all_lateral_;
  // The same of the markers measured last: rows of those not measured are zero.
  std::vector<std::uint8_t> measured_;
  Eigen::MatrixXd weighted_, normal_;
  // The first problem, in pressures only: lateral tractions are integrated out.
  Eigen::MatrixXd first_load_;    ///< of data over the noise: patches x 3 markers
  Eigen::MatrixXd first_normal_;  ///< patches x patches
  /// Made of something, since a fresh LLT has indeterminate members to copy.
  Eigen::LLT<Eigen::MatrixXd> first_factor_{Eigen::MatrixXd(Eigen::MatrixXd::Identity(1, 1))};
};

}  // namespace touchstone::sensors
