//! What holds of the public types whatever is in them.

use radiosity::backend::cost::RowCost;
use radiosity::backend::cpu::{RayGather, RayRows};
use radiosity::backend::gpu::{GpuLimits, HemicubeRows, TracedGather, TracedRows};
use radiosity::backend::{AdapterInfo, BackendRows, RowMaker};
use radiosity::bake::{BakeProgress, ErrorEstimate, GatherSettings, SolveSettings, Timings};
use radiosity::camera::RadianceImage;
use radiosity::form_factor::{Entry, ProximityCorrection, Row};
use radiosity::gather::{
    GatherPoint, IrradianceSample, Progress as GatherProgress, RadiosityField, RefinementSettings,
};
use radiosity::io::ToneCurve;
use radiosity::mesh::NodeId;
use radiosity::solver::{Ledger, Method, Progress, SolveSession, StopReason};
use radiosity::view_factor::{
    EnforcementReport, ErrorStats, Estimate, Factor, MatrixChecks, Missing,
};
use radiosity::*;

#[cfg(feature = "light-map")]
#[test]
fn light_maps_are_send_and_sync() {
    fn check<T: Send + Sync>() {}
    check::<light_map::Atlas>();
    check::<light_map::LightMap>();
}

#[test]
fn public_types_are_send_and_sync() {
    fn check<T: Send + Sync>() {}
    macro_rules! check_all { ($($type:ty),* $(,)?) => { $(check::<$type>();)* } }
    check_all![
        AdapterInfo,
        Backend,
        BackendRows,
        BakeProgress,
        BakeResult,
        BakeSettings,
        BakeTarget,
        Camera,
        EnforcementReport,
        Entry,
        Error,
        ErrorEstimate,
        ErrorKind,
        ErrorStats,
        Estimate,
        Factor,
        GatherPoint,
        GatherProgress,
        GatherSettings,
        GatheredMesh,
        Gpu,
        GpuLimits,
        HemicubeRows,
        IrradianceSample,
        Ledger,
        Material,
        MatrixChecks,
        Mesh,
        Method,
        Missing,
        NodeId,
        Progress,
        ProximityCorrection<RayRows>,
        RadianceImage,
        RadiosityField<'_>,
        RayGather,
        RayRows,
        RefinementSettings,
        Rgb,
        Row,
        RowCost,
        RowMaker,
        Scene,
        Solution,
        SolveSession<'_>,
        SolveSettings,
        Solver,
        StopReason,
        Timings,
        ToneCurve,
        Triangle,
        TracedGather,
        TracedRows,
        VertexMesh,
        ViewFactors,
    ];
}

#[test]
fn errors_can_be_boxed_and_sent() {
    fn check<T: std::error::Error + Send + Sync + 'static>() {}
    check::<Error>();
}
