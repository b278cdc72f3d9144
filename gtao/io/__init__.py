"""Files: G-buffers as EXR, records and coefficients as JSON, transport images, packed directions,
shader code.

Everything is written whole or not at all, and what cannot be read is refused in one line.
"""

from .atomic import atomic_path as atomic_path
from .atomic import ensure_writable as ensure_writable
from .atomic import write_text as write_text
from .bc4 import decode_bc4 as decode_bc4
from .bc4 import encode_bc4 as encode_bc4
from .cache import TransportCache as TransportCache
from .cache import default_cache_directory as default_cache_directory
from .codecs import PACKINGS as PACKINGS
from .codecs import Packing as Packing
from .dds import DDS_FORMATS as DDS_FORMATS
from .dds import DdsFormat as DdsFormat
from .dds import read_dds as read_dds
from .dds import write_dds as write_dds
from .directions import Directions as Directions
from .directions import direction_channels as direction_channels
from .directions import direction_manifest as direction_manifest
from .directions import directions_of as directions_of
from .directions import read_directions as read_directions
from .environments import read_environment as read_environment
from .environments import write_environment as write_environment
from .exr import read_gbuffer as read_gbuffer
from .exr import write_gbuffer as write_gbuffer
from .fits import fit_from_dict as fit_from_dict
from .fits import fit_of_record as fit_of_record
from .fits import fit_text as fit_text
from .fits import fit_to_dict as fit_to_dict
from .fits import read_fit as read_fit
from .fits import write_fit as write_fit
from .images import read_channels as read_channels
from .images import write_channels as write_channels
from .jsontext import canonical_json as canonical_json
from .jsontext import pretty_json as pretty_json
from .jsontext import with_infinities as with_infinities
from .origin import file_entry as file_entry
from .origin import git_state as git_state
from .origin import portable as portable
from .origin import provenance as provenance
from .origin import sha256_file as sha256_file
from .origin import versions as versions
from .packed_files import packed_suffix as packed_suffix
from .packed_files import read_packed as read_packed
from .packed_files import write_packed as write_packed
from .packing import PackingErrors as PackingErrors
from .packing import pack as pack
from .packing import packing_errors as packing_errors
from .packing import unpack as unpack
from .packing_code import packing_code as packing_code
from .radiance_hdr import read_radiance_hdr as read_radiance_hdr
from .records import number as number
from .records import read_record as read_record
from .records import without_timestamps as without_timestamps
from .records import write_record as write_record
from .shaders import shader_code as shader_code
from .transport import StoredTransport as StoredTransport
from .transport import read_transport as read_transport
from .transport import write_transport as write_transport
from .truth import read_truth as read_truth
