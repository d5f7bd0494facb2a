from cobodeck.logs.mrpt.rawlog import (
    is_rawlog as is_rawlog,
    read_rawlog as read_rawlog,
)
