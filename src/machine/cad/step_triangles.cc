#include "machine/cad/step_triangles.h"

#include <fmt/format.h>

#include <BRepMesh_IncrementalMesh.hxx>
#include <BRepTools.hxx>
#include <BRep_Tool.hxx>
#include <GeomAdaptor_Surface.hxx>
#include <Geom_Surface.hxx>
#include <IMeshTools_Parameters.hxx>
#include <Poly_PolygonOnTriangulation.hxx>
#include <Poly_Triangulation.hxx>
#include <Standard_Failure.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopLoc_Location.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Vertex.hxx>
#include <algorithm>
#include <cmath>
#include <gp_Trsf.hxx>
#include <limits>
#include <optional>
#include <utility>

#include "machine/cad/step_solid.h"

namespace trammel::machine {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

Eigen::Vector3d Vector(const gp_XYZ& at) { return {at.X(), at.Y(), at.Z()}; }

void Tessellate(const TopoDS_Shape& solid, double chord_error_mm) {
  IMeshTools_Parameters parameters;
  parameters.Deflection = chord_error_mm;
  parameters.Angle = 0.35;  // radians between neighbours, below what counts as an edge
  parameters.InParallel = false;
  parameters.InternalVerticesMode = true;
  parameters.ControlSurfaceDeflection = true;
  BRepTools::Clean(solid);
  const BRepMesh_IncrementalMesh mesh(solid, parameters);
}

std::size_t CountTriangles(const TopoDS_Shape& solid) {
  std::size_t count = 0;
  for (TopExp_Explorer face(solid, TopAbs_FACE); face.More(); face.Next()) {
    TopLoc_Location location;
    const auto mesh = BRep_Tool::Triangulation(TopoDS::Face(face.Current()), location);
    if (!mesh.IsNull()) count += static_cast<std::size_t>(mesh->NbTriangles());
  }
  return count;
}

/// Surface of a face's triangles.
class FaceSurface {
 public:
  explicit FaceSurface(const TopoDS_Face& face) {
    const auto surface = BRep_Tool::Surface(face, location_);
    surface_.Load(surface);
    to_part_ = location_.Transformation();
    flat_ = surface_.GetType() == GeomAbs_Plane;
  }
  [[nodiscard]] bool flat() const { return flat_; }

  // True if u has no effect there.
  [[nodiscard]] bool AtPole(const gp_XY& uv) const {
    gp_Pnt on;
    gp_Vec by_u;
    gp_Vec by_v;
    surface_.D1(uv.X(), uv.Y(), on, by_u, by_v);
    constexpr double kPole_mm = 1e-7;
    return by_u.Magnitude() < kPole_mm;
  }

  // Computes the distance of the surface from a point near these parameters, along the surface's
  // normal, positive towards `up`.
  [[nodiscard]] std::optional<double> Above(gp_XY uv, const gp_XYZ& at, const gp_XYZ& up) const {
    gp_Pnt on;
    gp_Vec by_u;
    gp_Vec by_v;
    constexpr int kRounds = 4;
    for (int round = 0; round < kRounds; ++round) {
      surface_.D1(uv.X(), uv.Y(), on, by_u, by_v);
      on.Transform(to_part_);
      by_u.Transform(to_part_);
      by_v.Transform(to_part_);
      const gp_Vec off(at - on.XYZ());
      const double uu = by_u.Dot(by_u);
      const double uv_ = by_u.Dot(by_v);
      const double vv = by_v.Dot(by_v);
      const double determinant = uu * vv - uv_ * uv_;
      constexpr double kFlat = 1e-12;
      if (!(determinant > kFlat * uu * vv)) return std::nullopt;  // at a pole
      const double ru = off.Dot(by_u);
      const double rv = off.Dot(by_v);
      const double du = (vv * ru - uv_ * rv) / determinant;
      const double dv = (uu * rv - uv_ * ru) / determinant;
      const double moved2 = du * du * uu + 2 * du * dv * uv_ + dv * dv * vv;
      constexpr double kStill2_mm2 = 1e-10;  // 10 nm aside changes the height by none
      if (moved2 < kStill2_mm2 || round + 1 == kRounds) {
        const gp_Vec normal = by_u.Crossed(by_v).Normalized();
        const double side = normal.Dot(gp_Vec(up)) < 0 ? -1 : 1;
        return -side * normal.Dot(off);
      }
      uv += gp_XY(du, dv);
    }
    return std::nullopt;
  }

 private:
  TopLoc_Location location_;
  GeomAdaptor_Surface surface_;
  gp_Trsf to_part_;
  bool flat_ = false;
};

/// Joins the faces' triangles.
class Triangles {
 public:
  explicit Triangles(const TopoDS_Shape& solid) {
    TopExp::MapShapes(solid, TopAbs_EDGE, edges_);
    TopExp::MapShapes(solid, TopAbs_VERTEX, vertices_);
    on_edge_.resize(static_cast<std::size_t>(edges_.Extent()) + 1);
    at_vertex_.assign(static_cast<std::size_t>(vertices_.Extent()) + 1, kNone);
  }

  Result<void> Add(const TopoDS_Face& face) {
    TopLoc_Location location;
    const auto mesh = BRep_Tool::Triangulation(face, location);
    ++made_.faces;
    if (mesh.IsNull() || mesh->NbTriangles() == 0) {
      return Fail(fmt::format(
          "face {}{} cannot be made triangles of; repair it in the CAD program, or export an STL",
          made_.faces, NearestPlace(face)));
    }
    const gp_Trsf to_part = location.Transformation();
    std::vector<std::uint32_t> number(static_cast<std::size_t>(mesh->NbNodes()) + 1, kNone);
    for (TopExp_Explorer at(face, TopAbs_EDGE); at.More(); at.Next()) {
      NumberEdge(TopoDS::Edge(at.Current()), mesh, location, number);
    }
    for (int i = 1; i <= mesh->NbNodes(); ++i) {
      std::uint32_t& n = number[static_cast<std::size_t>(i)];
      if (n == kNone) n = New(mesh->Node(i).Transformed(to_part));
    }
    const FaceSurface surface(face);
    const bool turned = face.Orientation() == TopAbs_REVERSED;
    for (int i = 1; i <= mesh->NbTriangles(); ++i) {
      std::array<int, 3> node{};
      mesh->Triangle(i).Get(node[0], node[1], node[2]);
      if (turned) std::swap(node[1], node[2]);
      made_.triangles.push_back({number[static_cast<std::size_t>(node[0])],
                                 number[static_cast<std::size_t>(node[1])],
                                 number[static_cast<std::size_t>(node[2])]});
      made_.lifts.push_back(surface.flat() || !mesh->HasUVNodes()
                                ? StepLift{}
                                : LiftOf(surface, *mesh, node, to_part));
    }
    return {};
  }

  [[nodiscard]] StepSolid Take() { return std::move(made_); }

 private:
  std::uint32_t New(const gp_Pnt& at) {
    made_.vertices_mm.push_back(Vector(at.XYZ()));
    return static_cast<std::uint32_t>(made_.vertices_mm.size() - 1);
  }

  // Numbers the nodes along an edge as in the edge's other face.
  void NumberEdge(const TopoDS_Edge& edge, const Handle(Poly_Triangulation) & mesh,
                  const TopLoc_Location& location, std::vector<std::uint32_t>& number) {
    const auto along = BRep_Tool::PolygonOnTriangulation(edge, mesh, location);
    if (along.IsNull()) return;
    const int n = along->NbNodes();
    const auto index = static_cast<std::size_t>(edges_.FindIndex(edge));
    std::vector<std::uint32_t>& known = on_edge_[index];
    if (known.empty()) known.assign(static_cast<std::size_t>(n), kNone);
    if (known.size() != static_cast<std::size_t>(n)) return;  // the crack is found later
    const bool pole = BRep_Tool::Degenerated(edge);
    for (int k = 1; k <= n; ++k) {
      const int node = along->Node(k);
      if (node < 1 || static_cast<std::size_t>(node) >= number.size()) continue;
      std::uint32_t* shared = &known[static_cast<std::size_t>(k - 1)];
      if (k == 1 || k == n || pole) {
        const TopoDS_Vertex end =
            k == n && !pole ? TopExp::LastVertex(edge) : TopExp::FirstVertex(edge);
        if (!end.IsNull()) shared = &at_vertex_[static_cast<std::size_t>(vertices_.FindIndex(end))];
      }
      if (*shared == kNone) *shared = New(mesh->Node(node).Transformed(location.Transformation()));
      number[static_cast<std::size_t>(node)] = *shared;
    }
  }

  static StepLift LiftOf(const FaceSurface& surface, const Poly_Triangulation& mesh,
                         const std::array<int, 3>& node, const gp_Trsf& to_part) {
    std::array<gp_XYZ, 3> at;
    std::array<gp_XY, 3> uv;
    std::array<bool, 3> any_u{};
    for (std::size_t k = 0; k < 3; ++k) {
      at[k] = mesh.Node(node[k]).Transformed(to_part).XYZ();
      uv[k] = mesh.UVNode(node[k]).XY();
      any_u[k] = surface.AtPole(uv[k]);
    }
    const gp_XYZ up = (at[1] - at[0]).Crossed(at[2] - at[0]);
    StepLift lift;
    std::array<double, 3> middle{};
    double left = 0;
    const auto above = [&](double a, double b, double c) {
      const std::array<double, 3> share = {a, b, c};
      gp_XY near = uv[0] * a + uv[1] * b + uv[2] * c;
      double of_u = 0;
      double u = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        of_u += any_u[k] ? 0 : share[k];
        u += any_u[k] ? 0 : share[k] * uv[k].X();
      }
      if (of_u > 0) near.SetX(u / of_u);
      return surface.Above(near, at[0] * a + at[1] * b + at[2] * c, up);
    };
    for (std::size_t k = 0; k < 3; ++k) {
      std::array<double, 3> share{};
      share[k] = share[(k + 1) % 3] = 0.5;
      middle[k] = above(share[0], share[1], share[2]).value_or(0);
      lift.middle_mm[k] = static_cast<float>(middle[k]);
    }
    const auto look = [&](double a, double b, double c) {
      const double wanted = 4 * (a * b * middle[0] + b * c * middle[1] + c * a * middle[2]);
      const auto found = above(a, b, c);
      left = std::max(left, found ? std::abs(*found - wanted) : std::abs(wanted));
    };
    look(1.0 / 3, 1.0 / 3, 1.0 / 3);
    look(0.75, 0.25, 0);
    look(0, 0.75, 0.25);
    look(0.25, 0, 0.75);
    lift.left_mm = static_cast<float>(left);
    return lift;
  }

  static std::string NearestPlace(const TopoDS_Face& face) {
    const TopExp_Explorer vertex(face, TopAbs_VERTEX);
    return vertex.More()
               ? fmt::format(" at {}", PlaceText(BRep_Tool::Pnt(TopoDS::Vertex(vertex.Current()))))
               : "";
  }

  TopTools_IndexedMapOfShape edges_;
  TopTools_IndexedMapOfShape vertices_;
  std::vector<std::vector<std::uint32_t>> on_edge_;
  std::vector<std::uint32_t> at_vertex_;
  StepSolid made_;
};

// Computes the factor on the chord error that limits the number of triangles. Their number varies
// as its power -1 on doubly curved surfaces, -1/2 on a cylinder, 0 on planes: two coarse
// tessellations show which.
double Coarser(const TopoDS_Shape& solid, const StepReadOptions& options) {
  constexpr double kStep = 5;
  const auto count = [&](double error_mm) {
    Tessellate(solid, error_mm);
    return std::max(1.0, static_cast<double>(CountTriangles(solid)));
  };
  const double few = count(kStep * kStep * options.chord_error_mm);
  const double more = count(kStep * options.chord_error_mm);
  const double power = std::clamp(std::log(more / few) / std::log(kStep), 0.1, 1.0);
  const double expected = more * std::pow(kStep, power);
  return std::max(1.0, std::pow(expected / static_cast<double>(options.max_triangles), 1 / power));
}

Result<StepSolid> MakeAt(const TopoDS_Shape& solid, double error_mm) {
  Tessellate(solid, error_mm);
  Triangles triangles(solid);
  for (TopExp_Explorer face(solid, TopAbs_FACE); face.More(); face.Next()) {
    TRY(triangles.Add(TopoDS::Face(face.Current())));
  }
  StepSolid made = triangles.Take();
  made.chord_error_mm = error_mm;
  return made;
}

Result<StepSolid> Make(const TopoDS_Shape& solid, const StepReadOptions& options) {
  double error_mm = options.chord_error_mm * Coarser(solid, options);
  // The quadratic surfaces' residual varies as the third power of the triangles' size.
  constexpr double kLeft_mm = 5e-4;
  constexpr int kMaxRounds = 3;
  for (int round = 1;; ++round) {
    auto made = MakeAt(solid, error_mm);
    if (!made || round == kMaxRounds) return made;
    double left_mm = 0;
    for (const StepLift& lift : made->lifts) left_mm = std::max<double>(left_mm, lift.left_mm);
    const double share = std::max(
        0.8 * std::pow(kLeft_mm / left_mm, 2.0 / 3),
        static_cast<double>(made->triangles.size()) / static_cast<double>(options.max_triangles));
    if (!(left_mm > kLeft_mm) || share > 0.8) return made;
    error_mm *= share;
  }
}

}  // namespace

Result<StepSolid> TrianglesOf(const TopoDS_Shape& solid, const StepReadOptions& options) {
  try {
    return Make(solid, options);
  } catch (const Standard_Failure& failure) {
    return Fail(fmt::format("Open CASCADE makes no triangles of it ({}); export an STL",
                            failure.DynamicType()->Name()));
  }
}

}  // namespace trammel::machine
