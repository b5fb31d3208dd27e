lc = 0.8;
Point(1) = {0,0,0,lc}; Point(2) = {3,0,0,lc}; Point(3) = {3,1,0,.2}; Point(4)={2.5,1.5,0,.2}; Point(5)={0,1.5,0,lc}; Point(6)={2.5,1,0,lc};
Line(1)={1,2}; Line(2)={2,3}; Circle(3)={3,6,4}; Line(4)={4,5}; Line(5)={5,1};
Point(10)={1,.75,0,.12}; Point(11)={1.3,.75,0,.12}; Point(12)={.7,.75,0,.12};
Circle(10)={11,10,12}; Circle(11)={12,10,11};
Curve Loop(1)={1,2,3,4,5}; Curve Loop(2)={10,11}; Plane Surface(1)={1,2};
Physical Curve("foot")={1}; Physical Curve("wall")={2,5}; Physical Curve("hole")={10,11}; Physical Surface("steel")={1};
