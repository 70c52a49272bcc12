// `Work` as read by the passes that cast rays of the points in its lists.

struct WorkRead {
    groups: array<u32, 8>,
    points: array<u32>,
}

@group(1) @binding(4) var<storage, read> work: WorkRead;
