#pragma once

namespace asperity {

/// Makes convert_mesh use OpenVDB's mesh conversion, and read_sparse and write_sparse its files. [main]
void register_vdb();

}  // namespace asperity
