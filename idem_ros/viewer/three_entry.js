// What the viewer needs of three.js; `make three` bundles it into three.min.js.
export {
  BufferAttribute, BufferGeometry, Color, LineBasicMaterial, LineSegments, Matrix4, PerspectiveCamera,
  Points, PointsMaterial, Scene, Vector3, WebGLRenderer, AxesHelper,
} from 'three';
export { OrbitControls } from 'three/addons/controls/OrbitControls.js';
