#include "machine/cad/step_solid.h"

#include <fmt/format.h>

#include <BRepBndLib.hxx>
#include <BRep_Tool.hxx>
#include <Bnd_Box.hxx>
#include <IFSelect_ReturnStatus.hxx>
#include <Interface_Check.hxx>
#include <Interface_EntityIterator.hxx>
#include <Interface_Graph.hxx>
#include <Interface_Protocol.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Message_Printer.hxx>
#include <STEPControl_Reader.hxx>
#include <Standard_Failure.hxx>
#include <StepData_StepModel.hxx>
#include <StepRepr_RepresentationItem.hxx>
#include <StepRepr_RepresentationRelationship.hxx>
#include <StepShape_ContextDependentShapeRepresentation.hxx>
#include <StepShape_ShapeDefinitionRepresentation.hxx>
#include <StepShape_ShapeRepresentation.hxx>
#include <StepShape_SolidModel.hxx>
#include <TColStd_SequenceOfAsciiString.hxx>
#include <TCollection_HAsciiString.hxx>
#include <TopExp.hxx>
#include <TopTools_IndexedDataMapOfShapeListOfShape.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopTools_ListOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Vertex.hxx>
#include <XSControl_TransferReader.hxx>
#include <XSControl_WorkSession.hxx>
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <istream>
#include <streambuf>
#include <utility>

namespace trammel::machine {
namespace {

// Stream of bytes in memory.
class BytesBuffer final : public std::streambuf {
 public:
  explicit BytesBuffer(std::string_view bytes) {
    char* const begin = const_cast<char*>(bytes.data());  // a get area, which nothing writes to
    setg(begin, begin, begin + bytes.size());
  }
};

std::string TextOf(const Handle(TCollection_HAsciiString) & text) {
  return text.IsNull() ? std::string() : std::string(text->ToCString());
}

// Returns the length unit of the file, which Open CASCADE converts to mm.
Result<std::string> UnitOf(STEPControl_Reader& reader) {
  TColStd_SequenceOfAsciiString lengths;
  TColStd_SequenceOfAsciiString angles;
  TColStd_SequenceOfAsciiString solid_angles;
  reader.FileUnits(lengths, angles, solid_angles);
  if (lengths.IsEmpty() || lengths(1).IsEmpty()) {
    return Fail(
        "it states no unit of length: whether it is in mm or in inches is not known; export it "
        "anew");
  }
  if (lengths.Length() > 1) {
    return Fail(fmt::format("it is drawn in two units, {} and {}; export it in one",
                            lengths(1).ToCString(), lengths(2).ToCString()));
  }
  std::string name = lengths(1).ToCString();
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  constexpr std::array<std::pair<std::string_view, std::string_view>, 4> kShort = {
      {{"millimetre", "mm"}, {"centimetre", "cm"}, {"metre", "m"}, {"micrometre", "µm"}}};
  for (const auto& [said, short_name] : kShort) {
    if (name == said) return std::string(short_name);
  }
  return name;
}

/// Entities of a file.
class Model {
 public:
  explicit Model(STEPControl_Reader& reader) : reader_(reader), model_(reader.StepModel()) {}

  // Checks that no entity of the shape was misread.
  [[nodiscard]] Result<void> CheckRead() const {
    const auto statements = model_->GlobalCheck(true);
    if (!statements.IsNull() && statements->HasFailed()) {
      return Fail(fmt::format("{}; it is damaged: export or copy it anew", statements->CFail(1)));
    }
    const Interface_Graph graph(model_, reader_.WS()->Protocol());
    std::vector<bool> seen(static_cast<std::size_t>(model_->NbEntities()) + 1, false);
    std::vector<int> open;
    const auto visit = [&](int i) {
      if (i < 1 || seen[static_cast<std::size_t>(i)]) return;
      seen[static_cast<std::size_t>(i)] = true;
      open.push_back(i);
    };
    for (int i = 1; i <= model_->NbEntities(); ++i) {
      if (IsShape(model_->Value(i))) visit(i);
    }
    while (!open.empty()) {
      const int i = open.back();
      open.pop_back();
      const auto check = model_->Check(i, true);
      if (model_->IsErrorEntity(i) || (!check.IsNull() && check->HasFailed())) {
        const std::string reason =
            !check.IsNull() && check->HasFailed() ? check->CFail(1) : "it cannot be read";
        return Fail(fmt::format("#{} ({}): {}; it is damaged: export or copy it anew", Number(i),
                                TypeOf(i), reason));
      }
      for (Interface_EntityIterator shared = graph.Shareds(model_->Value(i)); shared.More();
           shared.Next()) {
        visit(model_->Number(shared.Value()));
      }
    }
    return {};
  }

  [[nodiscard]] std::size_t CountSolids() const {
    std::size_t count = 0;
    for (int i = 1; i <= model_->NbEntities(); ++i) {
      if (model_->Value(i)->IsKind(STANDARD_TYPE(StepShape_SolidModel))) ++count;
    }
    return count;
  }

 private:
  [[nodiscard]] static bool IsShape(const Handle(Standard_Transient) & entity) {
    return entity->IsKind(STANDARD_TYPE(StepShape_ShapeRepresentation)) ||
           entity->IsKind(STANDARD_TYPE(StepShape_ShapeDefinitionRepresentation)) ||
           entity->IsKind(STANDARD_TYPE(StepShape_ContextDependentShapeRepresentation)) ||
           entity->IsKind(STANDARD_TYPE(StepRepr_RepresentationRelationship));
  }
  [[nodiscard]] int Number(int i) const { return model_->IdentLabel(model_->Value(i)); }
  [[nodiscard]] std::string TypeOf(int i) const {
    const Standard_CString name = model_->TypeName(model_->Value(i), false);
    return name != nullptr ? name : "unknown";
  }

  STEPControl_Reader& reader_;
  Handle(StepData_StepModel) model_;
};

// Describes a solid by its name in the file, if any, and its size.
std::string Described(const STEPControl_Reader& reader, const TopoDS_Shape& solid) {
  const auto entity = Handle(StepRepr_RepresentationItem)::DownCast(
      reader.WS()->TransferReader()->EntityFromShapeResult(solid, -1));
  const std::string name = entity.IsNull() ? std::string() : TextOf(entity->Name());
  Bnd_Box box;
  BRepBndLib::AddOptimal(solid, box, false, false);
  std::array<double, 6> at{};
  if (!box.IsVoid()) box.Get(at[0], at[1], at[2], at[3], at[4], at[5]);
  return fmt::format("{}{:.4g} × {:.4g} × {:.4g} mm about {}",
                     name.empty() || name == "NONE" ? "" : fmt::format("\"{}\" ", name),
                     at[3] - at[0], at[4] - at[1], at[5] - at[2],
                     PlaceText({(at[0] + at[3]) / 2, (at[1] + at[4]) / 2, (at[2] + at[5]) / 2}));
}

// Counts parts of one kind that belong to none of another.
int CountLoose(const TopoDS_Shape& shape, TopAbs_ShapeEnum kind, TopAbs_ShapeEnum in) {
  TopTools_IndexedMapOfShape all;
  TopExp::MapShapes(shape, kind, all);
  TopTools_IndexedDataMapOfShapeListOfShape held;
  TopExp::MapShapesAndAncestors(shape, kind, in, held);
  int loose = 0;
  for (int i = 1; i <= all.Extent(); ++i) {
    if (!held.Contains(all(i)) || held.FindFromKey(all(i)).IsEmpty()) ++loose;
  }
  return loose;
}

Result<void> CheckClosed(const TopoDS_Shape& solid) {
  TopTools_IndexedDataMapOfShapeListOfShape faces_of;
  TopExp::MapShapesAndAncestors(solid, TopAbs_EDGE, TopAbs_FACE, faces_of);
  int open = 0;
  TopoDS_Edge first;
  for (int i = 1; i <= faces_of.Extent(); ++i) {
    const TopoDS_Edge& edge = TopoDS::Edge(faces_of.FindKey(i));
    const TopTools_ListOfShape& faces = faces_of(i);
    if (faces.Extent() > 1 || BRep_Tool::Degenerated(edge)) continue;
    if (faces.Extent() == 1 && BRep_Tool::IsClosed(edge, TopoDS::Face(faces.First()))) continue;
    if (++open == 1) first = edge;
  }
  if (open == 0) return {};
  TopoDS_Vertex from;
  TopoDS_Vertex to;
  TopExp::Vertices(first, from, to);
  const TopoDS_Vertex& at = from.IsNull() ? to : from;
  return Fail(fmt::format(
      "its shell is open: {} edges belong to one face only{}; close the solid in the CAD program",
      open, at.IsNull() ? "" : fmt::format(", the first at {}", PlaceText(BRep_Tool::Pnt(at)))));
}

Result<TopoDS_Shape> OneSolid(const STEPControl_Reader& reader, const TopoDS_Shape& shape,
                              std::size_t stated) {
  TopTools_IndexedMapOfShape solids;
  TopExp::MapShapes(shape, TopAbs_SOLID, solids);
  TopTools_IndexedMapOfShape faces;
  TopExp::MapShapes(shape, TopAbs_FACE, faces);
  const int loose = CountLoose(shape, TopAbs_FACE, TopAbs_SOLID);
  if (solids.IsEmpty()) {
    if (stated > 0) {
      TRY(CheckClosed(shape));
      return Fail("its solid cannot be made; export the part anew, as AP214");
    }
    return Fail(
        faces.IsEmpty()
            ? std::string(
                  "it holds no solid; export the part's body as a solid (boundary representation)")
            : fmt::format("it holds surfaces only ({} faces), and no solid that tells inside from "
                          "outside; knit them to a solid in the CAD program",
                          faces.Extent()));
  }
  if (solids.Extent() > 1) {
    std::string named;
    constexpr int kMaxNamed = 4;
    for (int i = 1; i <= std::min(solids.Extent(), kMaxNamed); ++i) {
      named += fmt::format("{}{}", i == 1 ? "" : "; ", Described(reader, solids(i)));
    }
    if (solids.Extent() > kMaxNamed)
      named += fmt::format("; and {} more", solids.Extent() - kMaxNamed);
    return Fail(
        fmt::format("{} solids where one is wanted: {}; export the part alone, or unite them",
                    solids.Extent(), named));
  }
  if (stated > 1) {
    return Fail(fmt::format("of its {} solids only one can be made ({}); export the part alone",
                            stated, Described(reader, solids(1))));
  }
  if (loose > 0) {
    return Fail(
        fmt::format("beside its solid it holds {} faces that are part of none; export the "
                    "solid alone",
                    loose));
  }
  return solids(1);
}

// Checks the distance of edges and vertices from their surfaces: the reader widens their tolerances
// until they meet.
Result<void> CheckGaps(const TopoDS_Shape& solid, std::vector<std::string>& notices) {
  constexpr double kSaid_mm = 0.002;
  constexpr double kMax_mm = 0.02;
  double max_mm = 0;
  gp_Pnt where;
  TopTools_IndexedMapOfShape vertices;
  TopExp::MapShapes(solid, TopAbs_VERTEX, vertices);
  for (int i = 1; i <= vertices.Extent(); ++i) {
    const TopoDS_Vertex& vertex = TopoDS::Vertex(vertices(i));
    if (!(BRep_Tool::Tolerance(vertex) > max_mm)) continue;
    max_mm = BRep_Tool::Tolerance(vertex);
    where = BRep_Tool::Pnt(vertex);
  }
  if (max_mm > kMax_mm) {
    return Fail(
        fmt::format("its faces do not meet: they are up to {:.3f} mm apart, the worst at {}; it is "
                    "damaged or was exported too coarsely: repair it in the CAD program",
                    max_mm, PlaceText(where)));
  }
  if (max_mm > kSaid_mm) {
    notices.push_back(
        fmt::format("its faces meet within {:.4f} mm, worst at {}", max_mm, PlaceText(where)));
  }
  return {};
}

Result<CadSolid> Read(std::string_view text) {
  STEPControl_Reader reader;
  Message::DefaultMessenger()->RemovePrinters(STANDARD_TYPE(Message_Printer));
  Interface_Static::SetCVal("xstep.cascade.unit", "MM");  // which is there once a reader is
  // Disables the transformation of a root's placement, so that coordinates are those in the file.
  Interface_Static::SetCVal("read.step.root.transformation", "OFF");
  BytesBuffer buffer(text);
  std::istream stream(&buffer);
  if (reader.ReadStream("part.step", stream) != IFSelect_RetDone || reader.StepModel().IsNull()) {
    return Fail("Open CASCADE cannot read it: it is damaged; export or copy it anew");
  }
  const Model model(reader);
  TRY(model.CheckRead());
  auto unit = TRY(UnitOf(reader));
  const int roots = reader.NbRootsForTransfer();
  const int made = reader.TransferRoots();
  const std::size_t stated = model.CountSolids();
  if (made < roots && made > 0) {
    return Fail(
        fmt::format("of its {} shapes only {} can be made; export the part alone", roots, made));
  }
  CadSolid read;
  read.unit = std::move(unit);
  const TopoDS_Shape shape = made > 0 ? reader.OneShape() : TopoDS_Shape();
  if (shape.IsNull()) {
    return Fail(stated > 0 ? "its solid cannot be made; export the part anew, as AP214"
                           : "it holds no solid; export the part's body as a solid (boundary "
                             "representation)");
  }
  auto solid = TRY(OneSolid(reader, shape, stated));
  TRY(CheckClosed(solid));
  TRY(CheckGaps(solid, read.notices));
  read.solid = solid;
  return read;
}

}  // namespace

std::string PlaceText(const gp_Pnt& at_mm) {
  return fmt::format("({:.3f}, {:.3f}, {:.3f}) mm", at_mm.X(), at_mm.Y(), at_mm.Z());
}

Result<CadSolid> SolidOf(std::string_view text) {
  try {
    return Read(text);
  } catch (const Standard_Failure& failure) {
    const Standard_CString said = failure.GetMessageString();
    return Fail(fmt::format("Open CASCADE gives it up ({}{}{}); export it anew, as AP214",
                            failure.DynamicType()->Name(),
                            said != nullptr && *said != '\0' ? ": " : "",
                            said != nullptr ? said : ""));
  }
}

}  // namespace trammel::machine
