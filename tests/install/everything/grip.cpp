// grip DEVICE OBJECT PICTURE: presses with 0.5 N, as the gripper's library does it.

#include <cmath>
#include <cstdio>
#include <exception>

#include "gripper.h"

int main(int, char** arguments) {
  try {
    const double force = grip(arguments[1], arguments[2], 0.5, arguments[3]);
    std::printf("grip: %.5f N, 0.5 N were asked for\n", force);
    return std::abs(force - 0.5) < 1e-4 ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
