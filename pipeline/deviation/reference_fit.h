#pragma once

#include <cstddef>

#include "core/context.h"
#include "core/result.h"
#include "core/transform.h"
#include "pipeline/mesh/mesh.h"

namespace scanrig {

struct ReferenceFitOptions {
  double max_size_ratio = 2.0;        ///< of both surfaces' extents; beyond it the file has other units
  std::size_t vote_points = 700;      ///< of each surface, for the oriented point pairs
  int motions = 40;                   ///< that the votes propose
  double cost_cap = 0.03;             ///< distances beyond this share of the size count as this
  double tolerance = 0.02;            ///< of the size: a point nearer than this is confirmed
  double min_confirmed = 0.8;         ///< share of the measured surface that lies at the reference
  double min_covered = 0.6;           ///< share of the reference that lies at the model
  double other_way_deg = 10.0;        ///< motions closer than this are one
  double other_way_cost = 1.1;        ///< another motion that costs at most this much more fits as well
  std::size_t last_samples = 20'000;  ///< of the measured surface, for the last alignment
};

struct ReferenceFit {
  Transform reference_from_model = Transform::Identity();
  double confirmed = 0.0;       ///< share of the measured surface that lies at the reference
  bool fits_otherwise = false;  ///< another motion fits as well: a symmetric part
};

/// How the model lies in the frame of a reference, such as the design's mesh: votes of oriented point pairs [Drost et
/// al. 2010] propose motions, the measured surface is aligned point to plane from each, coarse to fine, and both
/// directions judge. Both in mm; the reference's faces point outwards. Same input, same bits. Fails with `degenerate`
/// (nothing measured, or no area), `no_overlap` (the reference does not fit), `stopped`.
Result<ReferenceFit> fit_to_reference(const Mesh& model, const Mesh& reference, const ReferenceFitOptions& options = {},
                                      const Context& context = {});

}  // namespace scanrig
