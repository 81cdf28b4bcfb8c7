// What a PDF's page draws: its pictures, and where on the sheet they come to lie.
#pragma once

#ifndef POINTERHOLDER_TRANSITION
#define POINTERHOLDER_TRANSITION 4  // std::shared_ptr, as newer releases have it
#endif
#include <qpdf/QPDFMatrix.hh>
#include <qpdf/QPDFObjectHandle.hh>
#include <qpdf/QPDFPageObjectHelper.hh>
#include <vector>

#include "base/result.h"

namespace trammel::machine {

/// A picture, or a mask through which a colour is drawn.
struct DrawnPicture {
  QPDFObjectHandle picture;
  QPDFMatrix sheet_from_picture;  ///< from the unit square, whose y runs up, to points

  /// Whether its rows run up the sheet, or it is mirrored: viewers show it the other way round.
  [[nodiscard]] bool mirrored() const;
  [[nodiscard]] double width_pt() const;
  [[nodiscard]] double height_pt() const;
  [[nodiscard]] double area_pt2() const;
};

/// The one picture that a scanner puts on a page; logos may lie beside it. Errors: no picture,
/// several that share the page (strips, or the layers of a compact PDF), one that is drawn askew.
[[nodiscard]] Result<DrawnPicture> PictureOf(QPDFPageObjectHelper& page);

}  // namespace trammel::machine
