#include "core/dense_solvers.h"

TS_DENSE_SOLVERS();
