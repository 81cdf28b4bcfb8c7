#include "support/step_text.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <map>
#include <utility>

namespace trammel::test {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kPoles = 5;
// Cubic, one knot in the middle: with poles at the means of three knots each x and y are linear.
constexpr std::array<double, kPoles> kGreville = {0, 1.0 / 6, 0.5, 5.0 / 6, 1};
constexpr std::array<double, 9> kKnots = {0, 0, 0, 0, 0.5, 1, 1, 1, 1};
// Above the block's height, mm: nothing about it is symmetric.
constexpr std::array<std::array<double, kPoles>, kPoles> kRise = {
    {{0, 1, 2, 1, 3}, {1, 9, 3, 4, 2}, {-1, 2, 12, -3, 1}, {2, -2, 5, 7, 0}, {4, 1, -1, 2, 1}}};

// Cox and de Boor, and its derivative.
double Basis(std::size_t i, std::size_t degree, double t) {
  if (degree == 0) {
    const bool last = t >= 1 && kKnots[i + 1] == 1 && kKnots[i] < 1;
    return (kKnots[i] <= t && t < kKnots[i + 1]) || last ? 1 : 0;
  }
  double sum = 0;
  const double left = kKnots[i + degree] - kKnots[i];
  const double right = kKnots[i + degree + 1] - kKnots[i + 1];
  if (left > 0) sum += (t - kKnots[i]) / left * Basis(i, degree - 1, t);
  if (right > 0) sum += (kKnots[i + degree + 1] - t) / right * Basis(i + 1, degree - 1, t);
  return sum;
}
double Slope(std::size_t i, double t) {
  double sum = 0;
  const double left = kKnots[i + 3] - kKnots[i];
  const double right = kKnots[i + 4] - kKnots[i + 1];
  if (left > 0) sum += 3 / left * Basis(i, 2, t);
  if (right > 0) sum -= 3 / right * Basis(i + 1, 2, t);
  return sum;
}

Vector3d Pole(const StepBlock& block, std::size_t i, std::size_t j) {
  return block.at_mm + Vector3d((kGreville[i] - 0.5) * block.size_mm.x(),
                                (kGreville[j] - 0.5) * block.size_mm.y(),
                                block.size_mm.z() + (block.freeform ? kRise[i][j] : 0));
}

std::string Real(double number) {
  std::string text = fmt::format("{:#.16g}", number);
  if (const std::size_t at = text.find('e'); at != std::string::npos) text[at] = 'E';
  return text;
}

class Writer {
 public:
  explicit Writer(double mm_per_unit) : mm_per_unit_(mm_per_unit) {}

  std::string Add(const std::string& entity) {
    text_ += fmt::format("#{}={};\n", ++count_, entity);
    return fmt::format("#{}", count_);
  }
  std::string Point(const Vector3d& at_mm) {
    const Vector3d at = at_mm / mm_per_unit_;
    return Add(
        fmt::format("CARTESIAN_POINT('',({},{},{}))", Real(at.x()), Real(at.y()), Real(at.z())));
  }
  std::string Direction(const Vector3d& along) {
    const Vector3d unit = along.normalized();
    return Add(
        fmt::format("DIRECTION('',({},{},{}))", Real(unit.x()), Real(unit.y()), Real(unit.z())));
  }
  std::string Placement(const Vector3d& at_mm, const Vector3d& axis, const Vector3d& x) {
    const std::string at = Point(at_mm);
    const std::string z = Direction(axis);
    return Add(fmt::format("AXIS2_PLACEMENT_3D('',{},{},{})", at, z, Direction(x)));
  }
  std::string Vertex(const Vector3d& at_mm) {
    return Add(fmt::format("VERTEX_POINT('',{})", Point(at_mm)));
  }
  std::string Line(const Vector3d& from_mm, const Vector3d& to_mm) {
    const std::string at = Point(from_mm);
    const std::string along = Add(fmt::format("VECTOR('',{},1.)", Direction(to_mm - from_mm)));
    return Add(fmt::format("LINE('',{},{})", at, along));
  }
  std::string Curve(const std::vector<Vector3d>& poles_mm) {
    std::string poles;
    for (const Vector3d& pole : poles_mm) poles += (poles.empty() ? "" : ",") + Point(pole);
    return Add(
        fmt::format("B_SPLINE_CURVE_WITH_KNOTS('',3,({}),.UNSPECIFIED.,.F.,.F.,(4,1,4),"
                    "(0.,0.5,1.),.UNSPECIFIED.)",
                    poles));
  }
  std::string Edge(const std::string& from, const std::string& to, const std::string& curve) {
    return Add(fmt::format("EDGE_CURVE('',{},{},{},.T.)", from, to, curve));
  }
  std::string Oriented(const std::string& edge, bool forward) {
    return Add(fmt::format("ORIENTED_EDGE('',*,*,{},{})", edge, forward ? ".T." : ".F."));
  }
  std::string Bound(const std::vector<std::string>& oriented, bool outer) {
    const std::string loop = Add(fmt::format("EDGE_LOOP('',({}))", fmt::join(oriented, ",")));
    return Add(fmt::format("FACE_{}BOUND('',{},.T.)", outer ? "OUTER_" : "", loop));
  }
  std::string Face(const std::vector<std::string>& bounds, const std::string& surface,
                   bool same = true) {
    return Add(fmt::format("ADVANCED_FACE('',({}),{},{})", fmt::join(bounds, ","), surface,
                           same ? ".T." : ".F."));
  }
  [[nodiscard]] double Length(double mm) const { return mm / mm_per_unit_; }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  double mm_per_unit_;
  std::string text_;
  int count_ = 0;
};

class BlockWriter {
 public:
  BlockWriter(Writer& writer, const StepBlock& block) : writer_(writer), block_(block) {
    for (int i = 0; i < 8; ++i) {
      corner_mm_[i] = Pole(block, (i & 1) != 0 ? kPoles - 1 : 0, (i & 2) != 0 ? kPoles - 1 : 0);
      if ((i & 4) == 0) corner_mm_[i].z() = block.at_mm.z();
      corner_[i] = writer.Vertex(corner_mm_[i]);
    }
  }

  std::vector<std::string> Faces(bool top) {
    const Vector3d x = Vector3d::UnitX();
    const Vector3d y = Vector3d::UnitY();
    const Vector3d z = Vector3d::UnitZ();
    std::vector<std::string> faces;
    faces.push_back(Flat({0, 2, 3, 1}, -z, {}));
    faces.push_back(Flat({0, 4, 6, 2}, -x, {}));
    faces.push_back(Flat({1, 3, 7, 5}, x, {}));
    // Both circles run counter-clockwise about y.
    std::array<std::string, 2> seam_end;
    std::array<std::string, 2> circle;
    const Vector3d axis_mm = block_.at_mm + Vector3d(block_.bore_x_mm, 0, block_.bore_z_mm);
    const double radius_mm = block_.bore_radius_mm;
    std::array<Vector3d, 2> seam_mm;
    for (std::size_t k = 0; k < 2; ++k) {
      const Vector3d middle_mm = axis_mm + (k == 0 ? -0.5 : 0.5) * block_.size_mm.y() * y;
      seam_mm[k] = middle_mm + radius_mm * x;
      seam_end[k] = writer_.Vertex(seam_mm[k]);
      const std::string placed = writer_.Placement(middle_mm, y, x);
      circle[k] = writer_.Edge(
          seam_end[k], seam_end[k],
          writer_.Add(fmt::format("CIRCLE('',{},{})", placed, Real(writer_.Length(radius_mm)))));
    }
    const std::string seam =
        writer_.Edge(seam_end[0], seam_end[1], writer_.Line(seam_mm[0], seam_mm[1]));
    faces.push_back(Flat({0, 1, 5, 4}, -y, {{circle[0], true}}));
    faces.push_back(Flat({2, 6, 7, 3}, y, {{circle[1], false}}));
    const std::string placed = writer_.Placement(axis_mm, y, x);
    const std::string wall = writer_.Add(
        fmt::format("CYLINDRICAL_SURFACE('',{},{})", placed, Real(writer_.Length(radius_mm))));
    const std::vector<std::string> around = {
        writer_.Oriented(circle[0], false), writer_.Oriented(seam, true),
        writer_.Oriented(circle[1], true), writer_.Oriented(seam, false)};
    faces.push_back(writer_.Face({writer_.Bound(around, true)}, wall, false));
    if (top) faces.push_back(Top());
    return faces;
  }

 private:
  // Returns the edge between two corners, made once.
  std::string Along(int from, int to) {
    const int low = std::min(from, to);
    const int high = std::max(from, to);
    std::string& edge = edges_[{low, high}];
    if (edge.empty()) {
      const bool curved = block_.freeform && low >= 4;
      edge = writer_.Edge(
          corner_[low], corner_[high],
          curved ? writer_.Curve(Rim(low, high)) : writer_.Line(corner_mm_[low], corner_mm_[high]));
    }
    return writer_.Oriented(edge, from < to);
  }
  // The poles of an edge of the top.
  [[nodiscard]] std::vector<Vector3d> Rim(int low, int high) const {
    std::vector<Vector3d> poles;
    for (std::size_t k = 0; k < kPoles; ++k) {
      const bool along_x = high - low == 1;
      const std::size_t i = along_x ? k : (low & 1) != 0 ? kPoles - 1 : 0;
      const std::size_t j = !along_x ? k : (low & 2) != 0 ? kPoles - 1 : 0;
      poles.push_back(Pole(block_, i, j));
    }
    return poles;
  }
  std::string Loop(const std::array<int, 4>& corners) {
    std::vector<std::string> edges;
    for (std::size_t k = 0; k < 4; ++k) edges.push_back(Along(corners[k], corners[(k + 1) % 4]));
    return writer_.Bound(edges, true);
  }
  // Corners counter-clockwise seen from outside.
  std::string Flat(const std::array<int, 4>& corners, const Vector3d& outward,
                   const std::vector<std::pair<std::string, bool>>& circles) {
    std::vector<std::string> bounds = {Loop(corners)};
    for (const auto& [edge, forward] : circles) {
      bounds.push_back(writer_.Bound({writer_.Oriented(edge, forward)}, false));
    }
    const Vector3d& at_mm = corner_mm_[corners[0]];
    const std::string placed = writer_.Placement(at_mm, outward, corner_mm_[corners[1]] - at_mm);
    return writer_.Face(bounds, writer_.Add(fmt::format("PLANE('',{})", placed)));
  }
  std::string Top() {
    if (!block_.freeform) return Flat({4, 5, 7, 6}, Vector3d::UnitZ(), {});
    std::vector<std::string> rows;
    for (std::size_t i = 0; i < kPoles; ++i) {
      std::vector<std::string> row;
      for (std::size_t j = 0; j < kPoles; ++j) row.push_back(writer_.Point(Pole(block_, i, j)));
      rows.push_back(fmt::format("({})", fmt::join(row, ",")));
    }
    const std::string surface = writer_.Add(
        fmt::format("B_SPLINE_SURFACE_WITH_KNOTS('',3,3,({}),.UNSPECIFIED.,.F.,.F.,.F.,(4,1,4),"
                    "(4,1,4),(0.,0.5,1.),(0.,0.5,1.),.UNSPECIFIED.)",
                    fmt::join(rows, ",")));
    return writer_.Face({Loop({4, 5, 7, 6})}, surface);
  }

  Writer& writer_;
  const StepBlock& block_;
  std::map<int, Vector3d> corner_mm_;
  std::map<int, std::string> corner_;
  std::map<std::pair<int, int>, std::string> edges_;
};

// The context of everything that is drawn, with its units.
std::string Context(Writer& writer, std::string_view unit) {
  const auto metric = [&](std::string_view prefix) {
    return writer.Add(fmt::format("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT({},.METRE.))", prefix));
  };
  std::string length;
  if (unit == "inch") {
    const std::string mm = metric(".MILLI.");
    const std::string factor =
        writer.Add(fmt::format("LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),{})", mm));
    const std::string exponents = writer.Add("DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.)");
    length = writer.Add(fmt::format("(CONVERSION_BASED_UNIT('INCH',{})LENGTH_UNIT()NAMED_UNIT({}))",
                                    factor, exponents));
  } else {
    length = metric(unit == "m" ? "$" : unit == "cm" ? ".CENTI." : ".MILLI.");
  }
  const std::string angle = writer.Add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))");
  const std::string solid_angle =
      writer.Add("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())");
  const std::string uncertainty =
      writer.Add(fmt::format("UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE({}),{},'distance','')",
                             Real(writer.Length(1e-6)), length));
  return writer.Add(
      fmt::format("(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT(({}))"
                  "GLOBAL_UNIT_ASSIGNED_CONTEXT(({},{},{}))REPRESENTATION_CONTEXT('','3D'))",
                  uncertainty, length, angle, solid_angle));
}

}  // namespace

std::string StepText(const std::vector<StepBlock>& solids, std::string_view unit, StepFault fault) {
  Writer writer(unit == "inch" ? 25.4 : unit == "m" ? 1000 : unit == "cm" ? 10 : 1);
  const std::string context = Context(writer, unit);
  std::vector<std::string> items = {
      writer.Placement(Vector3d::Zero(), Vector3d::UnitZ(), Vector3d::UnitX())};
  for (const StepBlock& block : solids) {
    const auto faces = BlockWriter(writer, block).Faces(fault != StepFault::kNoTop);
    const bool solid = fault != StepFault::kSurfacesOnly;
    const std::string shell = writer.Add(
        fmt::format("{}_SHELL('',({}))", solid ? "CLOSED" : "OPEN", fmt::join(faces, ",")));
    items.push_back(
        writer.Add(solid ? fmt::format("MANIFOLD_SOLID_BREP('{}',{})", block.name, shell)
                         : fmt::format("SHELL_BASED_SURFACE_MODEL('{}',({}))", block.name, shell)));
  }
  const std::string application = writer.Add("APPLICATION_CONTEXT('automotive design')");
  writer.Add(
      fmt::format("APPLICATION_PROTOCOL_DEFINITION('international standard',"
                  "'automotive_design',2000,{})",
                  application));
  const std::string kind =
      writer.Add(fmt::format("PRODUCT_CONTEXT('',{},'mechanical')", application));
  const std::string product = writer.Add(fmt::format("PRODUCT('part','part','',({}))", kind));
  const std::string version =
      writer.Add(fmt::format("PRODUCT_DEFINITION_FORMATION('','',{})", product));
  const std::string stage = writer.Add(
      fmt::format("PRODUCT_DEFINITION_CONTEXT('part definition',{},'design')", application));
  const std::string definition =
      writer.Add(fmt::format("PRODUCT_DEFINITION('design','',{},{})", version, stage));
  const std::string shape =
      writer.Add(fmt::format("PRODUCT_DEFINITION_SHAPE('','',{})", definition));
  const std::string drawn = writer.Add(
      fmt::format("{}_SHAPE_REPRESENTATION('part',({}),{})",
                  fault == StepFault::kSurfacesOnly ? "MANIFOLD_SURFACE" : "ADVANCED_BREP",
                  fmt::join(items, ","), context));
  writer.Add(fmt::format("SHAPE_DEFINITION_REPRESENTATION({},{})", shape, drawn));
  return "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('part.step',"
         "'2026-01-01T00:00:00',(''),(''),'','','');\nFILE_SCHEMA(('AUTOMOTIVE_DESIGN { 1 0 10303 "
         "214 1 1 1 1 }'));\nENDSEC;\nDATA;\n" +
         writer.text() + "ENDSEC;\nEND-ISO-10303-21;\n";
}

TopPoint TopAt(const StepBlock& block, double u, double v) {
  TopPoint point{Vector3d::Zero(), Vector3d::Zero()};
  Vector3d by_u = Vector3d::Zero();
  Vector3d by_v = Vector3d::Zero();
  for (std::size_t i = 0; i < kPoles; ++i) {
    for (std::size_t j = 0; j < kPoles; ++j) {
      const Vector3d pole = Pole(block, i, j);
      point.at_mm += Basis(i, 3, u) * Basis(j, 3, v) * pole;
      by_u += Slope(i, u) * Basis(j, 3, v) * pole;
      by_v += Basis(i, 3, u) * Slope(j, v) * pole;
    }
  }
  point.outward = by_u.cross(by_v).normalized();
  return point;
}

}  // namespace trammel::test
