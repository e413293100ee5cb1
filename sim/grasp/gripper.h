#pragma once
// Two equal fingers that hold a rigid object between their gels and lift it off a table.
//
// Gel frame of the finger that is looked at: the object is pressed along -z, gravity pulls along -y. By symmetry the
// other finger does the same, so each bears half the load, and the object doesn't turn: turns about the line through
// both fingers, which an off-centre grasp would make, are left out.
//
// Quasi-static while it sticks: the fingers' friction is at every moment the load that it has to carry. As long as the
// object stands on the table the arm pulls the gels along it; it leaves the table when they carry m (g + a). Where
// friction can't hold it in the air, it slides by m w' = m (g + a) - 2 F, w being its speed relative to the fingers, a
// the arm's acceleration upwards and F one finger's friction, until it sticks again, stands on the table or has fallen
// out.

#include <limits>

#include "fem/contact/press.h"

namespace touchstone::sim {

inline constexpr double kGravity_mm_s2 = 9806.65;  ///< standard gravity

/// What is gripped: rigid, with a weight.
struct GraspedBody {
  fem::ContactShape shape;
  double friction = 0.0;  ///< Coulomb's, against the gel; finite
  double mass_g = 0.0;
  double crush_force_N = std::numeric_limits<double>::infinity();  ///< normal force of a finger that breaks it
};

/// Where it stands at first, and how finely time is cut.
struct GripperSettings {
  RigidTransform gel_from_object;   ///< at the start; its z is set anew, see clearance_mm
  double clearance_mm = 0.1;        ///< between gel and object at the start, least over the gel's vertices
  bool table = true;                ///< false: nothing but the fingers carries the object
  double step_s = 1.0 / 60;         ///< longest step while it sticks or stands on the table
  double slide_step_s = 1.0 / 480;  ///< while it slides in the air
  double drop_mm = 6.0;             ///< it is lost when it has slid so far, or slid and isn't touched any more
};

/// What is true after an interval. Forces are one finger's.
struct GripperState {
  double seconds = 0.0;
  double finger_travel_mm = 0.0;  ///< each finger has closed by that
  double arm_height_mm = 0.0;
  double arm_speed_mm_s = 0.0;
  double sunk_mm = 0.0;             ///< the object's motion down relative to the fingers
  double slid_mm = 0.0;             ///< that part of it that it slid as a whole
  double sliding_speed_mm_s = 0.0;  ///< relative to the fingers, down; 0 while any of the contact sticks
  double object_height_mm = 0.0;    ///< over where it stood; 0 when it was dropped
  double normal_force_N = 0.0;
  double peak_normal_force_N = 0.0;  ///< so far
  double friction_N = 0.0;           ///< on the object, up
  double table_force_N = 0.0;
  bool touched = false;  ///< gel and object are in contact
  bool on_table = true;
  bool slipping = false;  ///< in contact, nothing sticks, and friction is all that Coulomb's law gives
  bool crushed = false;   ///< the normal force has once been above the body's limit
  bool dropped = false;   ///< slid or fallen out of the fingers; from then on the gel is bare
};

/// Both fingers and what is between them, step by step.
class Gripper {
 public:
  /// The compliance must outlive this. @throws Error for a body or setting that makes no sense, or an object that isn't
  /// over the gel
  Gripper(const fem::Compliance& gel, const GraspedBody& body, const GripperSettings& settings);

  /// Lets `seconds` pass, in which each finger closes evenly by `close_by_mm` (below 0: opens) and the arm accelerates
  /// upwards by `arm_acceleration_mm_s2`. @throws Error as fem::Press::step
  const GripperState& advance(double close_by_mm, double arm_acceleration_mm_s2, double seconds);

  /// From now on nothing but the fingers carries the object.
  void remove_table();

  const GripperState& state() const { return state_; }
  const fem::PressState& press() const { return press_.state(); }

 private:
  void place_object(const fem::Compliance& gel);
  void step_to(double sunk);
  void stand_on_table(double arm_acceleration);
  void hang(double arm_acceleration, double seconds);
  void slide(double arm_acceleration, double seconds);
  bool balance(double load);
  void release();
  double half_load(double arm_acceleration) const;

  GraspedBody body_;
  GripperSettings settings_;
  fem::Press press_;
  GripperState state_;
  Eigen::Vector3d start_ = Eigen::Vector3d::Zero();  // of the object's origin
  double mass_ = 0.0;                                // tonnes
  double stiffness_ = 0.0;  // of the contact along the gel, N/mm, as it answered to the last small motion; 0: not known
  bool table_ = true;       // stands below
  bool sliding_ = false;    // in the air
  double slid_in_air_ = 0.0;  // mm
};

}  // namespace touchstone::sim
