#pragma once
// The laws that are built in: settings and facts of each. One pair of files a law holds all of it.

#include "asperity/render/laws/avila.h"
#include "asperity/render/laws/cross_uncross.h"
#include "asperity/render/laws/dense_mesh.h"
#include "asperity/render/laws/force_shading.h"
#include "asperity/render/laws/generated_geometry.h"
#include "asperity/render/laws/god_object.h"
#include "asperity/render/laws/height_field.h"
#include "asperity/render/laws/magnetic.h"
#include "asperity/render/laws/mesostructure.h"
#include "asperity/render/laws/mesostructure_intended.h"
#include "asperity/render/laws/normal_perturbation.h"
#include "asperity/render/laws/proxy.h"
#include "asperity/render/laws/virtual_contact_point.h"
