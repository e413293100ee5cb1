#!/usr/bin/python3
"""The same pad and body in GetFEM (Debian's python3-getfem): the peer that bench_mechanics measures us against.

Reads the very mesh that we use (text, see read_mesh) and solves linear elasticity with the unilateral frictionless
contact of one rigid body: GetFEM's own assembly, its basic contact brick (augmented Lagrangian, semismooth Newton) and
MUMPS. Contact multipliers are P1 on the touched face and gaps are weighted by their hats, which is our discretisation
too, but every integral is taken here, by GetFEM.

Elements: taylor_hood (P2 displacement, P1 pressure), p2 and p1 (displacement alone).
Loads: sphere and punch (a sharp flat cylinder) in contact; plate (the whole face bonded to a rigid plate by P1
multipliers); pressure (a given P1 pressure 1 - r^2/radius^2, no contact). Bodies move straight down by `depth`.
Writes one JSON record (keys: see report). Units N, mm, MPa, s.
"""

import argparse
import json
import sys
import time

import getfem as gf
import numpy as np

VOLUME_RULE = "IM_TETRAHEDRON(3)"  # exact for products of P2 gradients with each other and with P1
GAP_RULE = "IM_TETRAHEDRON(8)"  # its faces carry a rule of degree 8
OUTER, BONDED = 1, 2  # regions
MOST_NEWTON_STEPS = 60
RESIDUAL = 1e-11


def read_mesh(path):
    """The arrays vertices (n x 3), tetrahedra (m x 4), outer, bonded (k x 3); each a line 'name count', then rows."""
    with open(path, encoding="utf-8") as file:
        words = file.read().split()
    arrays = {}
    at = 0
    for name, columns, kind in (("vertices", 3, float), ("tetrahedra", 4, int), ("outer", 3, int), ("bonded", 3, int)):
        if words[at] != name:
            sys.exit(f"{path}: '{name}' was expected where '{words[at]}' stands")
        size = int(words[at + 1]) * columns
        arrays[name] = np.array(words[at + 2 : at + 2 + size], dtype=kind).reshape(-1, columns)
        at += 2 + size
    return arrays


class Clock:
    """Seconds by name."""

    def __init__(self):
        self.seconds = {}
        self.begun = self.last = time.perf_counter()

    def lap(self, name):
        now = time.perf_counter()
        self.seconds[name] = now - self.last
        self.last = now

    def total(self):
        self.seconds["total"] = self.last - self.begun


class Pad:
    """The mesh in GetFEM with its spaces."""

    def __init__(self, arrays, element):
        points = arrays["vertices"]
        self.mesh = gf.Mesh("empty", 3)
        corners = points[arrays["tetrahedra"]]  # tetrahedron, corner, axis
        self.mesh.add_convex(gf.GeoTrans("GT_PK(3,1)"), np.asfortranarray(corners.transpose(2, 1, 0)))
        self._set_regions(points, arrays)
        order = 1 if element == "p1" else 2
        self.displacement = self._space(3, order)
        self.component = self._space(1, order)
        self.hats = self._space(1, 1)
        self.volume = gf.MeshIm(self.mesh, gf.Integ(VOLUME_RULE))
        self.face = gf.MeshIm(self.mesh, gf.Integ(GAP_RULE))
        self.on_face = self.hats.basic_dof_on_region(OUTER)
        self.places = self.hats.basic_dof_nodes()[:, self.on_face].T
        self.weights = self.integrals("1")

    def _space(self, components, order):
        space = gf.MeshFem(self.mesh, components)
        space.set_classical_fem(order)
        return space

    def _set_regions(self, points, arrays):
        """Finds our triangles among GetFEM's faces: its points are ours, numbered anew."""
        theirs = self.mesh.pts().T
        if len(theirs) != len(points):
            sys.exit(f"GetFEM has {len(theirs)} points, the mesh {len(points)}: some lie on each other")
        ours_of = np.empty(len(points), dtype=int)
        ours_of[np.lexsort(np.round(theirs, 9).T)] = np.lexsort(np.round(points, 9).T)
        if np.abs(theirs - points[ours_of]).max() > 1e-8:
            sys.exit("GetFEM's points aren't those of the mesh")
        ids, starts = self.mesh.pid_from_cvid(np.arange(self.mesh.nbcvs()))
        face_of = {}
        for solid, face in self.mesh.outer_faces().T:
            # Face k of a simplex is the one opposite to its corner k.
            corners = np.delete(ids[starts[solid] : starts[solid + 1]], face)
            face_of[tuple(sorted(ours_of[corners]))] = (solid, face)
        for region, triangles in ((OUTER, arrays["outer"]), (BONDED, arrays["bonded"])):
            self.mesh.set_region(region, np.array([face_of[tuple(sorted(t))] for t in triangles]).T)

    def integrals(self, expression):
        """int phi_i * expression dA for the hats of the touched face; `expression` is of X(1), X(2)."""
        text = f"({expression})*Test_l"
        every = gf.asm_generic(self.face, 1, text, OUTER, "l", 1, self.hats, np.zeros(self.hats.nbdof()))
        return np.ravel(every)[self.on_face]

    def normal_coupling(self, rows):
        """int phi_i u_z dA over the displacement's unknowns, for some hats of the touched face."""
        mass = gf.asm_mass_matrix(self.volume, self.hats, self.component, OUTER)
        mass = gf.Spmat("copy", mass, self.on_face[rows], range(self.component.nbdof()))
        mass.to_csc()
        starts, hat = mass.csc_ind()
        value = mass.csc_val()
        column = np.repeat(np.arange(len(starts) - 1), np.diff(starts))
        coupling = gf.Spmat("empty", len(rows), self.displacement.nbdof())
        for i, j, v in zip(hat, column, value):
            coupling.add(int(i), int(3 * j + 2), float(v))
        return coupling


def elastic_model(pad, arguments):
    shear = arguments.young / (2 * (1 + arguments.poisson))
    poisson = min(arguments.poisson, 0.5 - 1e-8)
    model = gf.Model("real")
    model.add_fem_variable("u", pad.displacement)
    model.add_initialized_data("G", [shear])
    model.add_initialized_data("lame", [2 * shear * poisson / (1 - 2 * poisson)])
    work = "2*G*(Sym(Grad_u):Grad_Test_u)"
    if arguments.element == "taylor_hood":
        model.add_fem_variable("p", pad.hats)
        work += " - p*Trace(Grad_Test_u) - Test_p*Trace(Grad_u) - p*Test_p/lame"
    else:
        work += " + lame*Trace(Grad_u)*Trace(Grad_Test_u)"
    model.add_linear_term(pad.volume, work, -1, 1)  # everywhere, symmetric
    model.add_Dirichlet_condition_with_simplification("u", BONDED)
    return model


def candidates(pad, arguments):
    """The hats that may touch, and the weighted gaps (mm^3) between the undeformed face and the body along +z."""
    x, y = arguments.centre
    radius, depth = arguments.radius, arguments.depth
    distance = np.hypot(pad.places[:, 0] - x, pad.places[:, 1] - y)
    if arguments.load == "punch":
        # The simple rule for a sharp edge: what lies under the flat face touches it.
        rows = np.flatnonzero(distance < radius)
        return rows, -depth * pad.weights[rows]
    # Twice the circle in which sphere and undeformed face overlap; report() says if the contact reaches its rim.
    rows = np.flatnonzero(distance < 2 * np.sqrt(2 * radius * depth))
    gap = f"{radius - depth!r}-sqrt(max({radius * radius!r}-sqr(X(1)-({x!r}))-sqr(X(2)-({y!r})),0))"
    return rows, pad.integrals(gap)[rows]


def add_contact(model, pad, arguments):
    rows, gap = candidates(pad, arguments)
    weights = pad.weights[rows]
    model.add_variable("touch", len(rows))  # pressure times -1
    model.add_initialized_data("gap", gap)
    # Augmentation: a modulus over an edge length, per weight of the hat, so that it has the units of the problem.
    model.add_initialized_data("r", [arguments.young / np.sqrt(weights.mean())])
    model.add_initialized_data("alpha", 1.0 / weights)
    symmetric_lagrangian = 2
    model.set(
        "add_basic_contact_brick", "u", "touch", "r", pad.normal_coupling(rows), "gap", "alpha", symmetric_lagrangian
    )
    return rows


def add_load(model, pad, arguments):
    """Returns a function that gives force, touching hats and candidates after the solve."""
    if arguments.load in ("sphere", "punch"):
        rows = add_contact(model, pad, arguments)

        def contact_result():
            pressure = np.abs(np.ravel(model.variable("touch")))
            touching = pressure > 1e-12 * pressure.max()
            return float(pressure @ pad.weights[rows]), int(touching.sum()), len(rows)

        return contact_result
    if arguments.load == "plate":
        model.add_initialized_data("push", [0.0, 0.0, -arguments.depth])
        hats = gf.MeshFem(pad.mesh, 3)
        hats.set_classical_fem(1)
        brick = model.add_Dirichlet_condition_with_multipliers(pad.volume, "u", hats, OUTER, "push")

        def plate_result():
            name = model.mult_varname_Dirichlet(brick)
            traction = gf.asm_generic(pad.face, 0, f"{name}(3)", OUTER, model)
            return abs(float(np.ravel(traction)[0])), len(pad.on_face), len(pad.on_face)

        return plate_result
    x, y = arguments.centre
    pressure = np.zeros(pad.hats.nbdof())
    square = (pad.places[:, 0] - x) ** 2 + (pad.places[:, 1] - y) ** 2
    pressure[pad.on_face] = np.maximum(0.0, 1.0 - square / arguments.radius**2)
    model.add_initialized_fem_data("load", pad.hats, pressure)
    model.add_source_term_brick(pad.volume, "u", "[0;0;-load]", OUTER)

    def pressure_result():
        return float(pressure[pad.on_face] @ pad.weights), int((pressure > 0).sum()), len(pad.on_face)

    return pressure_result


def work_of_pressure(model, pad):
    """int load * (-u_z) dA, N mm."""
    return float(np.ravel(gf.asm_generic(pad.face, 0, "-load*u(3)", OUTER, model))[0])


def report(arguments):
    arrays = read_mesh(arguments.mesh)
    clock = Clock()
    pad = Pad(arrays, arguments.element)
    clock.lap("mesh")
    model = elastic_model(pad, arguments)
    result = add_load(model, pad, arguments)
    clock.lap("model")
    model.assembly("build_all")
    clock.lap("assembly")
    steps, converged = model.solve("max_iter", MOST_NEWTON_STEPS, "max_res", RESIDUAL, "lsolver", "mumps")
    clock.lap("newton")
    clock.total()
    # Once more by itself, outside the total: what one of Newton's linear systems costs.
    gf.linsolve_mumps(model.tangent_matrix(), model.rhs())
    clock.lap("factorise_once")
    force, touching, rows = result()
    displacement = np.ravel(model.variable("u"))
    return {
        "program": "GetFEM",
        "element": arguments.element,
        "load": arguments.load,
        "force_N": force,
        "work_Nmm": work_of_pressure(model, pad) if arguments.load == "pressure" else None,
        "peak_displacement_mm": float(np.abs(displacement[2::3]).max()),
        "unknowns": int(model.tangent_matrix().size()[0]),
        "tetrahedra": int(pad.mesh.nbcvs()),
        "touching": touching,
        "candidates": rows,
        "newton_steps": int(steps),
        "converged": bool(converged),
        "seconds": clock.seconds,
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("mesh")
    parser.add_argument("--out", required=True)
    parser.add_argument("--element", choices=("taylor_hood", "p2", "p1"), default="taylor_hood")
    parser.add_argument("--load", choices=("sphere", "punch", "plate", "pressure"), default="sphere")
    parser.add_argument("--young", type=float, default=1.0)
    parser.add_argument("--poisson", type=float, default=0.49)
    parser.add_argument("--radius", type=float, default=8.0)
    parser.add_argument("--depth", type=float, default=0.3)
    parser.add_argument("--centre", type=float, nargs=2, default=(0.0, 0.0))
    arguments = parser.parse_args()
    gf.util_trace_level(0)
    record = report(arguments)
    with open(arguments.out, "w", encoding="utf-8") as file:
        json.dump(record, file, indent=1)
        file.write("\n")


main()
