use radiosity::*; use radiosity::form_factor::*; use glam::DVec3; use std::time::Instant;
fn main(){
  let path=std::env::args().nth(1).unwrap(); let size:f64=std::env::args().nth(2).unwrap().parse().unwrap(); let n:u32=std::env::args().nth(3).unwrap().parse().unwrap();
  let s=std::fs::read_to_string(path).unwrap();
  let mut pos=vec![]; let mut tris=vec![];
  for l in s.lines(){ let w:Vec<&str>=l.split_whitespace().collect(); if w.is_empty(){continue;}
    if w[0]=="v"{pos.push(DVec3::new(w[1].parse().unwrap(),w[2].parse().unwrap(),w[3].parse().unwrap()));}
    if w[0]=="f"{ let k:Vec<u32>=w[1..].iter().map(|x|x.split('/').next().unwrap().parse::<u32>().unwrap()-1).collect(); for i in 2..k.len(){tris.push(Triangle{corners:[k[0],k[i-1],k[i]],group:0,material:0});}}}
  let scene=Scene::new(pos,tris,vec!["a".into()],vec![Material::grey("m",0.5)]).unwrap();
  let mesh=Mesh::new(scene,size).unwrap();
  let gpu=Gpu::new(None).unwrap(); println!("{:?}",gpu.adapter());
  let mut h=Hemicubes::new(&gpu,&mesh,n).unwrap();
  println!("elements {} batch {}",mesh.element_count(),h.batch());
  let patches:Vec<NodeId>=(0..512usize.max(h.batch())).map(|k|mesh.element(k*7919%mesh.element_count())).collect();
  let _=h.rows(&mesh,&patches[..h.batch()]).unwrap();
  for _ in 0..3 { let s0=h.seconds(); let d0=h.drawn();
  let t=Instant::now(); let rows=h.rows(&mesh,&patches).unwrap(); let e=t.elapsed().as_secs_f64()*1e3/patches.len() as f64;
  let s1=h.seconds(); let d=(h.drawn()-d0) as f64;
  let nnz:usize=rows.iter().map(|r|r.entries.len()).sum();
  println!("{:.3} ms/hemicube draw {:.3} reduce {:.3} readback {:.3}; nnz {}", e,(s1.draw-s0.draw)*1e3/d,(s1.reduce-s0.reduce)*1e3/d,(s1.readback-s0.readback)*1e3/d, nnz/rows.len());
  for r in &rows { r.check(&mesh,patches[0]).unwrap(); } }
}
